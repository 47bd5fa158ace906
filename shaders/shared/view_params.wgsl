// Parameters of the kernels that follow views, and the size of a piece.

struct ViewParams {
    first: u32,
    count: u32,
    threads: u32,
    // 0 counts, 1 writes.
    mode: u32,
    faces: u32,
    nodes_at: u32,
    edges_at: u32,
    // Bounces before what is looked for; 0 looks from the windows.
    level: u32,
    // Steps that a thread may take before it hands on what is left.
    budget: u32,
    // More than one; not known to the compiler.
    probe: u32,
    lies_m: f32,
    // Where the number of pieces, or of pairs, stands.
    total_at: u32,
    // Parts into which the tree is cut.
    parts: u32,
    // A face of each patch, four to a word.
    patches_at: u32,
    // What the kernel may write: pairs, or words of pieces that are through.
    room: u32,
    // Pieces that go on for which there is room.
    room_on: u32,
}

// Words of a piece: (target, view, corners | whole << 8, next node), (next face | faces left << 24, least area, source | turned << 31,
// beam), then two a corner, (uv, first line), (second line, line of the side to the next corner).
const PIECE: u32 = 34u;
