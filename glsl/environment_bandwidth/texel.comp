#version 460
// Cycles per radian from the details that cover each 2x2 block of the map: where their sum from the finest level on reaches
// `eps` of the largest. src/frequency/wavelet.rs and environment.rs are the f64 twins.
#include "angles.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 2, binding = 0) uniform sampler2D details;  // the first level is at the origin
layout(set = 2, binding = 1) uniform sampler2D covering; // from the second level on
layout(set = 2, binding = 2, r32f) uniform writeonly image2D bandwidth;
layout(push_constant) uniform Push {
    ivec2 size;   // of the map that is analysed, powers of two
    int levels;
    float eps;
    float bias;
};

const float FLOOR = 0.1; // of the mean luminance, which is 1 here
const float SLOPE = 4.0;

// Where the sums of four blocks crossed their thresholds.
struct Crossing {
    vec4 sum;     // of all levels so far
    vec4 at;      // at the crossing
    vec4 before;  // one level finer
    vec4 level;   // 0: not yet
};

void add(inout Crossing c, vec4 detail, vec4 threshold, float level) {
    vec4 sum = c.sum + detail;
    vec4 now = vec4(lessThan(c.level, vec4(0.5))) * vec4(greaterThanEqual(sum, threshold));
    bvec4 crossed = greaterThan(now, vec4(0.5));
    c.at = mix(c.at, sum, crossed);
    c.before = mix(c.before, c.sum, crossed);
    c.level = mix(c.level, vec4(level), crossed);
    c.sum = sum;
}

// Cycles per texel.
vec4 frequency(Crossing c, vec4 threshold) {
    bvec4 none = lessThan(c.level, vec4(0.5));
    vec4 at = mix(c.at, vec4(1.0), none);
    vec4 slope = log2(at / max(c.before, at / SLOPE));
    vec4 back = log2(at / threshold) / slope;
    back = mix(back, min(back, 1.0), greaterThan(c.level, vec4(1.5)));
    return mix(exp2(back - c.level) / bias, vec4(0.0), none);
}

// The blocks of level h that lie over the four of this invocation.
vec2 over(ivec2 invocation, int h) {
    return texelFetch(covering, ivec2(size.x / 2, size.y - ((2 * size.y) >> (h - 1))) + (invocation >> (h - 2)), 0).xy;
}

void main() {
    ivec2 invocation = ivec2(gl_GlobalInvocationID.xy), first = 2 * invocation, count = max(size / 2, 1);
    if (any(greaterThanEqual(first, count))) {
        return;
    }
    // The first level: two blocks each way cover one, and the four share nine. Its torus has as many rows as the map.
    vec2 d[9];
    for (int k = 0; k < 9; ++k) {
        ivec2 p = first + ivec2(k % 3 - 1, k / 3 - 1);
        d[k] = texelFetch(details, ivec2(p.x & (size.x / 2 - 1), p.y & (size.y - 1)), 0).xy;
    }
    vec4 x, y;
    for (int k = 0; k < 4; ++k) {
        int corner = (k >> 1) * 3 + (k & 1);
        vec2 largest = max(max(d[corner], d[corner + 1]), max(d[corner + 3], d[corner + 4]));
        x[k] = largest.x;
        y[k] = largest.y;
    }
    float coarse = FLOOR;
    for (int h = 2; h <= levels; ++h) {
        vec2 m = over(invocation, h);
        coarse = max(coarse, max(m.x, m.y));
    }
    vec4 threshold = eps * max(vec4(coarse), max(x, y));

    Crossing across = Crossing(vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0)), down = across;
    add(across, x, threshold, 1.0);
    add(down, y, threshold, 1.0);
    for (int h = 2; h <= levels; ++h) {
        vec2 m = over(invocation, h);
        add(across, vec4(m.x), threshold, float(h));
        add(down, vec4(m.y), threshold, float(h));
    }
    x = frequency(across, threshold);
    y = frequency(down, threshold);

    // Over the singular values of the map from texels to the sphere. A wavelet counts as lying a quarter of its cycle away from
    // a pole at least.
    float column = 2.0 * PI / float(size.x), row = PI / float(size.y);
    for (int k = 0; k < 4; ++k) {
        ivec2 p = first + ivec2(k & 1, k >> 1);
        float v = (float(p.y) + 0.5) * 2.0 / float(size.y);
        float pole = max(PI * min(v, 1.0 - v), 0.25 * row / max(x[k], 1e-9));
        float b = max(x[k] / (column * cos_sin(min(pole, HALF_PI)).y), y[k] / row);
        if (all(lessThan(p, count))) {
            imageStore(bandwidth, p, vec4(b));
        }
    }
}
