// Parameters of the kernels of visibility by lines, and states of their segments.

struct LineParams {
    // Records of the input, or its room where the device has the number.
    count: u32,
    // 0 counts, 1 writes.
    mode: u32,
    // Which of its lists the kernel works on.
    stage: u32,
    // Zero, not known to the compiler.
    zero: u32,
    // More than one, not known to the compiler.
    probe: u32,
    // Where parts of `body` begin.
    traits_at: u32,
    corners_at: u32,
    edges_at: u32,
    halves_at: u32,
    piercings_at: u32,
    nodes_at: u32,
    scenes_at: u32,
    windows_at: u32,
    groups_at: u32,
    // Where parts of `views` begin.
    legs_at: u32,
    spaces_at: u32,
    outlines_at: u32,
    hulls_at: u32,
    // Number of views.
    views: u32,
    // Numbers of the lists that a kernel reads and writes, and for how many records there is room; shares have as much.
    list_in: u32,
    list_out: u32,
    room: u32,
    // Whether threads say how many tests they made.
    counts_work: u32,
}

// As in src/trace/cpu/lines.rs, which says why.
const BESIDE_M: f32 = 6e-9;
const BESIDE: f32 = 0.02;
const SLACK_M: f32 = 0.05;
const TOUCHING_M: f32 = 1e-8;
const SHORTEST_M: f32 = 1e-10;
const EDGE_ON: f32 = 1e-9;
const STEEP: f32 = 1e-3;
const ON_MIRROR: f32 = 1e-12;
const ROUNDING_M: f32 = 1e-9;
const LIES_M: f32 = 2e-4;

// Rounding of f32, as a share of the lengths that enter a sum of products: signs of larger values are certain.
const ROUNDED: f32 = 1e-6;

// Kinds of segments.
const OF_EDGE: u32 = 0u;
const OF_WALL: u32 = 1u;
const OF_OUTLINE: u32 = 2u;

// States of segments.
const DEAD: u32 = 1u;
const HIT: u32 = 2u;
const ALONG: u32 = 4u;
const FREE_POSITIVE: u32 = 8u;
const FREE_NEGATIVE: u32 = 16u;
const IS_SIDE: u32 = 32u;
// A bit for each half-face that has a fragment, or the number of the half-face of a fragment, from here on.
const HALVES: u32 = 8u;

// `sizes`: what the host refuses, then the size of each list, and from NEEDED on how large it would be.
const NEEDED: u32 = 16u;

// Nodes of the tree over edges that have one box together, and such groups that have another one together and are one thread's.
const GROUP: u32 = 64u;
const GROUPS: u32 = 8u;
// Fragments of an outline that have one box together.
const HULL: u32 = 16u;
// Segments are cut into as many equal parts as they span this in view, rad.
const WIDEST: f32 = 0.1;

const NONE: u32 = 0xffffffffu;
