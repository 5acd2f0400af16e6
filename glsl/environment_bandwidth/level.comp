#version 460
// One level of the two-dimensional Daubechies transform of four taps on a torus: averages, and the larger amplitudes of details
// across columns and across rows (those across both count for either). src/frequency/wavelet.rs is the f64 twin.
layout(local_size_x = 8, local_size_y = 8) in;
// The first level's torus is the map over its copy reflected at the pole.
layout(constant_id = 0) const bool FIRST = true;
layout(set = 2, binding = 0) uniform sampler2D signal;
layout(set = 2, binding = 1, r32f) uniform writeonly image2D average;
layout(set = 2, binding = 2, rgba16f) uniform writeonly image2D details; // across columns, across rows
layout(push_constant) uniform Push {
    ivec2 size;   // of the torus, powers of two
    ivec2 place;  // of this level in `details`
};

// Over sqrt 2 of the orthonormal taps, so that averages are averages and details amplitudes.
const vec4 LOW = vec4(0.341506350946, 0.591506350946, 0.158493649054, -0.091506350946);
const int TALL = 4; // rows of coefficients an invocation
const vec4 HIGH = vec4(LOW.w, -LOW.z, LOW.y, -LOW.x);

float fetch(int x, int y) {
    if (FIRST) {
        bool copied = y * 2 >= size.y;
        return texelFetch(signal, ivec2((copied ? x + size.x / 2 : x) & (size.x - 1), copied ? size.y - 1 - y : y), 0).r;
    }
    return texelFetch(signal, ivec2(x, y), 0).r;
}

// Four samples from column x on: averages and details of the two coefficients that start at x and x + 2.
vec4 row(int x, int y) {
    y &= size.y - 1;
    float s[6];
    for (int k = 0; k < 6; ++k) {
        s[k] = fetch((x + k) & (size.x - 1), y);
    }
    vec4 a = vec4(s[0], s[1], s[2], s[3]), b = vec4(s[2], s[3], s[4], s[5]);
    return vec4(dot(LOW, a), dot(LOW, b), dot(HIGH, a), dot(HIGH, b));
}

void main() {
    ivec2 first = ivec2(2, TALL) * ivec2(gl_GlobalInvocationID.xy), count = size / 2;
    if (any(greaterThanEqual(first, count))) {
        return;
    }
    vec4 rows[2 * TALL + 2];
    for (int k = 0; k < 2 * TALL + 2; ++k) {
        rows[k] = row(2 * first.x, 2 * first.y + k);
    }
    for (int j = 0; j < TALL; ++j) {
        vec4 low = vec4(0.0), high = vec4(0.0);
        for (int k = 0; k < 4; ++k) {
            low += LOW[k] * rows[2 * j + k];
            high += HIGH[k] * rows[2 * j + k];
        }
        vec2 both = abs(high.zw), x = max(abs(low.zw), both), y = max(abs(high.xy), both);
        for (int i = 0; i < 2; ++i) {
            ivec2 p = first + ivec2(i, j);
            if (all(lessThan(p, count))) {
                imageStore(average, p, vec4(low[i]));
                // Nobody asks for those of the copy, but for the two rows next to the map's first across the seam.
                if (p.y * 2 < count.y || p.y + 2 >= count.y) {
                    imageStore(details, place + p, vec4(x[i], y[i], 0.0, 0.0));
                }
            }
        }
    }
}
