// Four Gaussians of lobes in the stereographic plane (src/distribution/expectation.rs is the f64 twin). What the four have is in the
// components of vectors. The includer defines MIXTURES_BINDING.
#ifndef MIXTURES_GLSL
#define MIXTURES_GLSL

// As how many samples a lobe counts where it is shared out.
const float SAMPLES_A_LOBE = 4.0;
// Gaussians of less of a texel's mass than this are none.
const float LEAST_SHARE = 1e-9;

// Mass; mass times place; mass times mean products, with the lobes' own variance.
struct Sums {
    vec4 q;
    vec4 x;
    vec4 y;
    vec4 xx;
    vec4 xy;
    vec4 yy;
};
const Sums NOTHING = Sums(vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));

// What a texel's neighbours have of each: the sum of its shares, and its mean place.
struct Prior {
    vec4 share;
    vec4 x;
    vec4 y;
    float strength;
};

// As lobes are compared with them; the logarithms of those of nothing are far below all.
struct Components {
    vec4 log;
    vec4 x;
    vec4 y;
    vec4 xx; // of the inverse of the covariance
    vec4 xy;
    vec4 yy;
    float samples;
};

// Of all levels, coarsest first, texel by texel, six each: from the middle of the map.
layout(set = 2, binding = MIXTURES_BINDING, std430) buffer Mixtures {
    vec4 mixtures[];
};

float total_of(vec4 v) {
    return (v.x + v.y) + (v.z + v.w);
}

void add_weighted(inout Sums s, int at, float weight) {
    s.q += mixtures[at] * weight;
    s.x += mixtures[at + 1] * weight;
    s.y += mixtures[at + 2] * weight;
    s.xx += mixtures[at + 3] * weight;
    s.xy += mixtures[at + 4] * weight;
    s.yy += mixtures[at + 5] * weight;
}

// The moments of a level of size `above`, from vector `first` on, at the centre of texel p of `size`; it repeats.
Sums between(int first, ivec2 above, ivec2 p, ivec2 size) {
    vec2 at = (vec2(p) + 0.5) * vec2(above) / vec2(size) - 0.5, low = floor(at), part = at - low;
    ivec2 a = ivec2(low), b = a + 1;
    a += ivec2(lessThan(a, ivec2(0))) * above;
    b -= ivec2(greaterThanEqual(b, above)) * above;
    Sums s = NOTHING;
    add_weighted(s, first + 6 * (a.y * above.x + a.x), (1.0 - part.x) * (1.0 - part.y));
    add_weighted(s, first + 6 * (a.y * above.x + b.x), part.x * (1.0 - part.y));
    add_weighted(s, first + 6 * (b.y * above.x + a.x), (1.0 - part.x) * part.y);
    add_weighted(s, first + 6 * (b.y * above.x + b.x), part.x * part.y);
    return s;
}

// What a neighbour with these moments, from 0, has of each.
Prior prior_of(Sums s, float strength) {
    float total = total_of(s.q);
    bvec4 there = greaterThan(s.q, vec4(LEAST_SHARE * total));
    vec4 inverse = 1.0 / mix(vec4(1.0), s.q, there);
    return Prior(mix(vec4(0.0), s.q / max(total, 1e-37), there), s.x * inverse, s.y * inverse, strength);
}

// The most probable ones of these moments, those of each from its own place x, y: round no narrower than the variance `least`, which
// no lobe is below, so that only rounding is cut off.
Components components_of(Sums s, vec4 x, vec4 y, Prior prior, float least, float samples) {
    float total = total_of(s.q);
    bvec4 there = greaterThan(s.q, vec4(LEAST_SHARE * total));
    vec4 inverse = 1.0 / mix(vec4(1.0), s.q, there);
    vec4 off_x = s.x * inverse, off_y = s.y * inverse;
    vec4 xx = max(s.xx * inverse - off_x * off_x, least), yy = max(s.yy * inverse - off_y * off_y, least);
    vec4 xy = s.xy * inverse - off_x * off_y;
    // (1 + P)^-1 P off with P = pull times covariance, multiplied out: large numbers cancel in it otherwise.
    vec4 pull = 2.0 * prior.strength * total * prior.share * inverse;
    vec4 determinant = max(xx * yy - xy * xy, 0.0);
    vec4 scale = pull / (1.0 + pull * (xx + yy) + pull * pull * determinant);
    vec4 own_x = x + off_x, own_y = y + off_y;
    vec4 to_x = prior.x - own_x, to_y = prior.y - own_y;
    vec4 moved_x = scale * (xx * to_x + xy * to_y + pull * determinant * to_x);
    vec4 moved_y = scale * (xy * to_x + yy * to_y + pull * determinant * to_y);
    xx += moved_x * moved_x;
    yy += moved_y * moved_y;
    vec4 most = 0.999 * sqrt(xx * yy);
    xy = clamp(xy + moved_x * moved_y, -most, most);
    determinant = xx * yy - xy * xy;
    Components c;
    c.log = mix(vec4(-1e30), log(max(s.q / max(total, 1e-37), 1e-37)) - 0.5 * samples * log(determinant), there);
    c.x = mix(vec4(0.0), own_x + moved_x, there);
    c.y = mix(vec4(0.0), own_y + moved_y, there);
    vec4 of_inverse = mix(vec4(0.0), 1.0 / determinant, there);
    c.xx = yy * of_inverse;
    c.xy = -xy * of_inverse;
    c.yy = xx * of_inverse;
    c.samples = samples;
    return c;
}

// A lobe is its place, its variance and its mass.
vec4 scores(Components c, vec4 lobe) {
    vec4 x = lobe.x - c.x, y = lobe.y - c.y;
    vec4 square = c.xx * x * x + 2.0 * c.xy * x * y + c.yy * y * y;
    return c.log - 0.5 * c.samples * (square + lobe.z * (c.xx + c.yy));
}

float greatest(vec4 v) {
    return max(max(v.x, v.y), max(v.z, v.w));
}

// 1 for the first of the greatest, 0 for others.
vec4 first_greatest(vec4 v) {
    vec4 is = vec4(equal(v, vec4(greatest(v))));
    is.y *= 1.0 - is.x;
    is.z *= 1.0 - (is.x + is.y);
    is.w *= 1.0 - (is.x + is.y + is.z);
    return is;
}

#endif
