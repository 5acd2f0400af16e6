#version 460
// The mixtures of one level of a map's mips (src/distribution/alignment.rs is the f64 twin): expectation and maximisation over the
// lobes below each texel, from what lies between the moments of the level above, whose means draw those of the texel; then the moments
// of all lobes below by what was found. Sums are taken from the places where Gaussians are, in the same order in every run.
#include "cover.glsl"
#define MIXTURES_BINDING 1
#include "mixtures.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
// Whether a group fits a texel, or each of its invocations one.
layout(constant_id = 0) const bool TOGETHER = false;
// Texels from one that an invocation looks at to its next, and of how many in a row it adds up the moments at a time.
layout(constant_id = 1) const int ACROSS = 1;
layout(constant_id = 2) const int WIDE = 1;
layout(set = 2, binding = 0, std430) readonly buffer Lobes {
    vec4 lobes[];
};
layout(set = 2, binding = 2, std430) readonly buffer Places {
    vec2 places[];
};
layout(set = 2, binding = 3, rgba32f) uniform writeonly image2DArray gaussians;
layout(push_constant) uniform Push {
    ivec2 from;     // size of the map
    ivec2 above;    // size of the level above
    vec2 across;    // texels of the map in one of this level
    int first;      // vector of the level above
    int to;         // and of this one
    int count;      // of a texel's lobes
    int layer;
    uint upright;   // whether lobes are about normals, which are behind them else
    uint some;      // whether the fit looks at some of the lobes below, at the places
    float strength; // of the prior
    float least;    // variance
};

const int PLACES = 1024;
const int ROUNDS = 8;
// Of them those in which a lobe counts once.
const int SOFT_ROUNDS = 2;
// Further fits are for at least as many lobes, and have to raise the mean logarithm of their likelihood by this.
const int WORTH_LOBES = 16;
const float WORTH = 0.3;

shared float parts[28 * 64];
shared float sums[28];

ivec2 p;
ivec2 size;
ivec2 local;
int lane;
Cover columns;
Cover rows;
ivec2 corner;

// Hands in vector `k` of what the group adds up.
void put(int k, vec4 v) {
    int at = 256 * k + lane;
    parts[at] = v.x;
    parts[at + 64] = v.y;
    parts[at + 128] = v.z;
    parts[at + 192] = v.w;
}

// Of the first `count` vectors.
void add_up(int count) {
    barrier();
    if (lane < 4 * count) {
        float sum = 0.0;
        for (int i = 0; i < 64; i += 8) {
            float part = 0.0;
            for (int k = 0; k < 8; ++k) {
                part += parts[64 * lane + i + k];
            }
            sum += part;
        }
        sums[lane] = sum;
    }
    barrier();
}

vec4 got(int k) {
    return vec4(sums[4 * k], sums[4 * k + 1], sums[4 * k + 2], sums[4 * k + 3]);
}

// The greatest of the group's, the one of the least number where some are alike.
void furthest(inout float far, inout float mass, inout vec3 place, inout float number) {
    put(0, vec4(far, number, mass, 0.0));
    put(1, vec4(place, 0.0));
    barrier();
    for (int i = 0; i < 64; ++i) {
        float its = parts[i];
        float numbered = parts[64 + i];
        bool better = its > far || (its == far && numbered < number);
        far = better ? its : far;
        number = better ? numbered : number;
        mass = better ? parts[128 + i] : mass;
        place = better ? vec3(parts[256 + i], parts[320 + i], parts[384 + i]) : place;
    }
    barrier();
}

// One of the lobes that a fit looks at.
struct Walk {
    ivec2 at;
    int lobe;
};

ivec2 walk_first() {
    return some != 0u ? ivec2(lane, local.y) : ivec2(columns.first, rows.first) + local;
}

ivec2 walk_last() {
    return some != 0u ? ivec2(PLACES - 1, 7) : ivec2(columns.last, rows.last);
}

Walk walk_begin() {
    return Walk(walk_first(), 0);
}

bool walk_there(Walk w) {
    return all(lessThanEqual(w.at, walk_last()));
}

void walk_next(inout Walk w) {
    if (++w.lobe < count) {
        return;
    }
    w.lobe = 0;
    w.at.x += some != 0u ? ACROSS * ACROSS : ACROSS;
    if (w.at.x > walk_last().x) {
        w.at = ivec2(walk_first().x, w.at.y + ACROSS);
    }
}

float walk_number(Walk w) {
    return float((some != 0u ? w.at.x : w.at.y * from.x + w.at.x) * count + w.lobe);
}

int stride() {
    return upright != 0u ? count : count + 1;
}

float share_of(ivec2 texel) {
    return cover_share(columns, texel.x, from.x, size.x) * cover_share(rows, texel.y, from.y, size.y);
}

vec4 walk_lobe(Walk w) {
    ivec2 texel = w.at;
    float share;
    if (some != 0u) {
        texel = min(corner + ivec2(places[w.at.x] * across), from - 1);
        share = 1.0 / float(PLACES);
    } else {
        share = share_of(texel);
    }
    vec4 lobe = lobes[(texel.y * from.x + texel.x) * stride() + w.lobe];
    return vec4(lobe.xyz, lobe.w * share);
}

// Adds a lobe at x, y from each by these shares.
void add(inout Sums s, vec4 shares, vec4 x, vec4 y, vec4 lobe) {
    vec4 q = shares * lobe.w;
    s.q += q;
    s.x += q * x;
    s.y += q * y;
    s.xx += q * (x * x + lobe.z);
    s.xy += q * (x * y);
    s.yy += q * (y * y + lobe.z);
}

void all_of(inout Sums s, inout vec4 other) {
    if (TOGETHER) {
        put(0, s.q);
        put(1, s.x);
        put(2, s.y);
        put(3, s.xx);
        put(4, s.xy);
        put(5, s.yy);
        put(6, other);
        add_up(7);
        s = Sums(got(0), got(1), got(2), got(3), got(4), got(5));
        other = got(6);
    }
}

#include "divide.glsl"

// The shares of a lobe; and the logarithm of its likelihood.
vec4 shares_of(Components c, vec4 lobe, out float likelihood) {
    vec4 of = scores(c, lobe);
    float most = greatest(of);
    of = exp(of - most);
    float sum = total_of(of);
    likelihood = (most + log(sum)) / c.samples;
    return of / sum;
}

// The moments of the lobes that the fit looks at, each from where its Gaussian is, and the mean logarithm of their likelihood.
Sums expectation(Components c, out float likelihood) {
    Sums s = NOTHING;
    likelihood = 0.0;
    for (Walk w = walk_begin(); walk_there(w); walk_next(w)) {
        vec4 lobe = walk_lobe(w);
        float its;
        vec4 shares = shares_of(c, lobe, its);
        likelihood += lobe.w * its;
        add(s, shares, lobe.x - c.x, lobe.y - c.y, lobe);
    }
    vec4 all_likelihood = vec4(likelihood, 0.0, 0.0, 0.0);
    all_of(s, all_likelihood);
    likelihood = all_likelihood.x / max(total_of(s.q), 1e-37);
    return s;
}

// Adds what is in lobe i of a texel of the row y to what Gaussians have of the row; nothing beyond the last column.
void add_texel(Components c, ivec2 texel, int i, inout Sums s, inout vec4 normal_x, inout vec4 normal_y) {
    float there = texel.x > columns.last ? 0.0 : 1.0;
    texel.x = min(texel.x, columns.last);
    int at = (texel.y * from.x + texel.x) * stride();
    vec4 lobe = lobes[at + i];
    lobe.w *= there * cover_share(columns, texel.x, from.x, size.x);
    float its;
    vec4 shares = shares_of(c, lobe, its);
    add(s, shares, lobe.x - c.x, lobe.y - c.y, lobe);
    if (upright == 0u) {
        vec2 normal = lobes[at + count].xy;
        normal_x += shares * (lobe.w * normal.x);
        normal_y += shares * (lobe.w * normal.y);
    }
}

void add_row(inout Sums s, Sums row, float share) {
    s.q += row.q * share;
    s.x += row.x * share;
    s.y += row.y * share;
    s.xx += row.xx * share;
    s.xy += row.xy * share;
    s.yy += row.yy * share;
}

// Of all lobes below, from the middle of the map; and mass times places of normals.
Sums moments(Components c, out vec4 normal_x, out vec4 normal_y) {
    Sums s = NOTHING;
    normal_x = vec4(0.0);
    normal_y = vec4(0.0);
    for (int y = rows.first + local.y; y <= rows.last; y += ACROSS) {
        // Rows on their own: long sums round more.
        Sums row = NOTHING;
        vec4 row_x = vec4(0.0), row_y = vec4(0.0);
        for (int x = columns.first + local.x; x <= columns.last; x += ACROSS * WIDE) {
            for (int i = 0; i < count; ++i) {
                add_texel(c, ivec2(x, y), i, row, row_x, row_y);
                if (TOGETHER) {
                    add_texel(c, ivec2(x + 8, y), i, row, row_x, row_y);
                    add_texel(c, ivec2(x + 16, y), i, row, row_x, row_y);
                    add_texel(c, ivec2(x + 24, y), i, row, row_x, row_y);
                }
            }
        }
        float share = cover_share(rows, y, from.y, size.y);
        add_row(s, row, share);
        normal_x += row_x * share;
        normal_y += row_y * share;
    }
    vec4 none = vec4(0.0);
    all_of(s, none);
    if (TOGETHER && upright == 0u) {
        put(0, normal_x);
        put(1, normal_y);
        add_up(2);
        normal_x = got(0);
        normal_y = got(1);
    }
    s.xx += c.x * (2.0 * s.x + c.x * s.q);
    s.xy += c.x * s.y + c.y * s.x + c.x * c.y * s.q;
    s.yy += c.y * (2.0 * s.y + c.y * s.q);
    s.x += c.x * s.q;
    s.y += c.y * s.q;
    return s;
}

void keep(Sums s, vec4 normal_x, vec4 normal_y) {
    int at = to + 6 * (p.y * size.x + p.x);
    mixtures[at] = s.q;
    mixtures[at + 1] = s.x;
    mixtures[at + 2] = s.y;
    mixtures[at + 3] = s.xx;
    mixtures[at + 4] = s.xy;
    mixtures[at + 5] = s.yy;
    vec4 square = s.xx + s.yy;
    for (int k = 0; k < 4; ++k) {
        imageStore(gaussians, ivec3(p, layer + k), vec4(s.q[k], s.x[k], s.y[k], square[k]));
        if (upright == 0u) {
            imageStore(gaussians, ivec3(p, layer + 4 + k), vec4(normal_x[k], normal_y[k], 0.0, 0.0));
        }
    }
}

void main() {
    size = imageSize(gaussians).xy;
    p = ivec2(TOGETHER ? gl_WorkGroupID.xy : gl_GlobalInvocationID.xy);
    local = TOGETHER ? ivec2(gl_LocalInvocationID.xy) : ivec2(0);
    lane = local.y * 8 + local.x;
    if (any(greaterThanEqual(p, size))) {
        return;
    }
    columns = cover(p.x, from.x, size.x);
    rows = cover(p.y, from.y, size.y);
    corner = ivec2(columns.first, rows.first);
    int looked_at = (some != 0u ? PLACES : (columns.last - columns.first + 1) * (rows.last - rows.first + 1)) * count;

    Sums start = between(first, above, p, size);
    Prior prior = prior_of(start, strength);
    Components best;
    vec4 x = vec4(0.0), y = vec4(0.0), free = vec4(0.0);
    float likelihood = 0.0;
    for (int fit = 0; fit < 4; ++fit) {
        if (fit > 0) {
            vec2 at;
            if (!divide(best, free, start, at)) {
                break;
            }
            x = at.xxxx;
            y = at.yyyy;
        }
        Components c = components_of(start, x, y, prior, least, 1.0);
        Sums s;
        float its;
        for (int round = 1; round <= ROUNDS; ++round) {
            s = expectation(c, its);
            c = components_of(s, c.x, c.y, prior, least, round < SOFT_ROUNDS ? 1.0 : SAMPLES_A_LOBE);
        }
        if (fit > 0 && its < likelihood + WORTH) {
            break;
        }
        best = c;
        likelihood = its;
        free = free_of(s.q);
        if (looked_at < WORTH_LOBES || greatest(free) == 0.0) {
            break;
        }
    }
    vec4 normal_x, normal_y;
    Sums found = moments(best, normal_x, normal_y);
    if (lane == 0) {
        keep(found, normal_x, normal_y);
    }
}
