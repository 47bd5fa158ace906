//! Triangles of a scene at one instant, in the world, with their planes, coplanar patches and wide
//! BVH. Rebuilt for each frame in which something moves.

pub mod bvh;
