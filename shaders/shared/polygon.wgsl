// Convex polygons and the lines that cut them. There is one polygon at work and the lines of a face in
// memory of the thread, and a pool of finished pieces in the binding `scratch` of the entry point, where
// thread t of `scratch_threads` has every word that is t modulo that number: large arrays of a thread's own
// are slow to compile.

// Corners that a polygon may have while it is cut.
const CAP: u32 = 24u;
// Pieces with more corners are halved, so that CAP suffices: two lines beside the 8 edges of a face.
const MOST: u32 = 12u;
const PIECES: u32 = 32u;
// Behind the corners of all pieces, and what does not fit the last one, stand their numbers.
const NUMBERS: u32 = 408u;

// What a thread has no room for; the host refuses the result.
const TOO_MANY_CORNERS: u32 = 1u;
const TOO_MANY_PIECES: u32 = 2u;
const TOO_MANY_STEPS: u32 = 4u;
var<private> trouble: u32;

var<private> ring: array<vec2<f32>, 24>;
var<private> corners: u32;
// What the last cut took off stands behind the pieces.
var<private> off_corners: u32;
var<private> off_twice: f32;
var<private> off_first: vec2<f32>;
var<private> off_last: vec2<f32>;
var<private> lines: array<vec3<f32>, 10>;
var<private> line_count: u32;
var<private> parting: vec3<f32>;
var<private> pieces: u32;
var<private> scratch_thread: u32;
var<private> scratch_threads: u32;

fn word(i: u32) -> u32 {
    return i * scratch_threads + scratch_thread;
}

fn piece_corners(i: u32) -> u32 {
    return u32(scratch[word(NUMBERS + i)].x);
}

fn set_piece_corners(i: u32, n: u32) {
    scratch[word(NUMBERS + i)] = vec2<f32>(f32(n), 0.0);
}

fn piece_corner(i: u32, c: u32) -> vec2<f32> {
    return scratch[word(i * MOST + c)];
}

fn cross2(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return a.x * b.y - a.y * b.x;
}

// Where a x + b y + c is positive. A line at infinity keeps or drops everything, by the sign of c.
fn line_from(a: f32, b: f32, c: f32) -> vec3<f32> {
    let l = length(vec2<f32>(a, b));
    if l > 1e-7 * abs(c) {
        return vec3<f32>(a, b, c) / l;
    }
    return vec3<f32>(0.0, 0.0, select(-1e18, 1e18, c >= 0.0));
}

// Distance from the line, with what is nearer than `eps` on it.
fn line_at(line: vec3<f32>, p: vec2<f32>, eps: f32) -> f32 {
    let d = dot(line.xy, p) + line.z;
    return select(d, 0.0, abs(d) <= eps);
}

fn take_off(p: vec2<f32>) {
    scratch[word(pieces * MOST + off_corners)] = p;
    if off_corners == 0u {
        off_first = p;
    } else {
        off_twice += cross2(off_last - off_first, p - off_first);
    }
    off_last = p;
    off_corners += 1u;
}

// Keeps the part of the polygon at work where the line is positive; the rest is there for `append` if it is
// wanted.
fn cut(line: vec3<f32>, eps: f32, wanted: bool) {
    let n = corners;
    let first = ring[0];
    let d_first = line_at(line, first, eps);
    var p = first;
    var d = d_first;
    var kept = 0u;
    off_corners = 0u;
    off_twice = 0.0;
    for (var i = 1u; i <= n; i += 1u) {
        // The next corner is read before its place may be taken.
        var q = first;
        var e = d_first;
        if i < n {
            q = ring[i];
            e = line_at(line, q, eps);
        }
        if d >= 0.0 {
            ring[kept] = p;
            kept += 1u;
        }
        let crosses = (d < 0.0 && e > 0.0) || (d > 0.0 && e < 0.0);
        let x = p + (q - p) * (d / (d - e));
        if crosses {
            ring[kept] = x;
            kept += 1u;
        }
        if wanted {
            if d <= 0.0 {
                take_off(p);
            }
            if crosses {
                take_off(x);
            }
        }
        // No convex polygon crosses a line more than twice.
        if kept > i + 1u || kept >= CAP {
            trouble |= TOO_MANY_CORNERS;
            break;
        }
        p = q;
        d = e;
    }
    corners = kept;
}

// Signed area of the polygon at work, positive counter-clockwise.
fn area() -> f32 {
    if corners < 3u {
        return 0.0;
    }
    let o = ring[0];
    var a = ring[1] - o;
    var twice = 0.0;
    for (var i = 2u; i < corners; i += 1u) {
        let b = ring[i] - o;
        twice += cross2(a, b);
        a = b;
    }
    return 0.5 * twice;
}

// Adds what was cut off to the pool if it is more than a sliver, halved when it has many corners.
fn append(least: f32) {
    let n = off_corners;
    if n < 3u || 0.5 * abs(off_twice) <= least {
        return;
    }
    if n > 22u {
        trouble |= TOO_MANY_CORNERS;
        return;
    }
    let halved = n > MOST;
    if pieces + select(1u, 2u, halved) > PIECES {
        trouble |= TOO_MANY_PIECES;
        return;
    }
    if !halved {
        set_piece_corners(pieces, n);
        pieces += 1u;
        return;
    }
    let h = n / 2u;
    let base = pieces * MOST;
    scratch[word(base + MOST + n - h)] = off_first;
    for (var i = n; i > h; i -= 1u) {
        scratch[word(base + MOST + i - 1u - h)] = scratch[word(base + i - 1u)];
    }
    set_piece_corners(pieces, h + 1u);
    set_piece_corners(pieces + 1u, n - h + 1u);
    pieces += 2u;
}

// Adds the polygon at work to the pool.
fn stash() {
    off_corners = 0u;
    off_twice = 0.0;
    for (var i = 0u; i < corners; i += 1u) {
        take_off(ring[i]);
    }
    append(0.0);
}

// Makes piece `i` the polygon at work.
fn take(i: u32) {
    corners = piece_corners(i);
    for (var c = 0u; c < corners; c += 1u) {
        ring[c] = piece_corner(i, c);
    }
}

fn move_piece(i: u32, to: u32) {
    let n = piece_corners(i);
    for (var c = 0u; c < n; c += 1u) {
        scratch[word(to * MOST + c)] = piece_corner(i, c);
    }
    set_piece_corners(to, n);
}

// (least, greatest) of both coordinates of the polygon at work.
fn bounds() -> vec4<f32> {
    var lo = ring[0];
    var hi = lo;
    for (var i = 1u; i < corners; i += 1u) {
        lo = min(lo, ring[i]);
        hi = max(hi, ring[i]);
    }
    return vec4<f32>(lo, hi);
}

// Whether the box lies on the negative side of one of the lines; if not, `parting` is the line that comes
// nearest to it.
fn apart(box: vec4<f32>, eps: f32) -> bool {
    var least = 1e30;
    for (var l = 0u; l < line_count; l += 1u) {
        let line = lines[l];
        let most = reach(line, box, 1.0);
        if most < least {
            least = most;
            parting = line;
        }
    }
    return least <= eps;
}

// Whether the polygon at work lies on the negative side of `parting`, as neighbours do.
fn parted(eps: f32) -> bool {
    var most = -1e30;
    for (var i = 0u; i < corners; i += 1u) {
        most = max(most, dot(parting.xy, ring[i]) + parting.z);
    }
    return most <= eps;
}

// The greatest distance from the line of a place in the box, or, with -1, the least.
fn reach(line: vec3<f32>, box: vec4<f32>, most: f32) -> f32 {
    let centre = 0.5 * (box.xy + box.zw);
    let half = 0.5 * (box.zw - box.xy);
    return dot(line.xy, centre) + line.z + most * dot(abs(line.xy), half);
}

// Keeps the part of the polygon at work, which the box holds, that lies inside of `lines`.
fn cut_outline(box: vec4<f32>, eps: f32) {
    for (var l = 0u; l < line_count; l += 1u) {
        let line = lines[l];
        if reach(line, box, -1.0) < -eps {
            cut(line, eps, false);
            if corners < 3u {
                break;
            }
        }
    }
}

// Takes the inside of `lines` out of all pieces. True when something was taken.
fn subtract(least: f32, eps: f32) -> bool {
    var end = pieces;
    var i = 0u;
    var any = false;
    while i < end {
        take(i);
        let box = bounds();
        if apart(box, eps) || parted(eps) {
            i += 1u;
            continue;
        }
        let mark = pieces;
        for (var l = 0u; l < line_count; l += 1u) {
            let line = lines[l];
            if reach(line, box, -1.0) < -eps {
                cut(line, eps, true);
                append(least);
                if corners < 3u {
                    break;
                }
            }
        }
        if corners < 3u || abs(area()) <= least {
            // It was only touched, and stays whole.
            pieces = mark;
            i += 1u;
            continue;
        }
        any = true;
        pieces -= 1u;
        if pieces >= mark {
            // The last fragment takes its place.
            move_piece(pieces, i);
            i += 1u;
        } else if pieces > i {
            move_piece(pieces, i);
            if pieces < end {
                // That one has not had its turn yet.
                end = pieces;
            } else {
                i += 1u;
            }
        } else {
            end = pieces;
        }
    }
    return any;
}
