// How shaded samples share the directions of a frame (Bagher et al. 2011, section 2.3): by weights in a histogram, whose
// logarithms to base 2 the bandwidth pass writes. src/frequency/allocation.rs is the f64 twin.
#ifndef ALLOCATION_GLSL
#define ALLOCATION_GLSL
#include "list.glsl"
#include "sobol.glsl"

const int ALLOCATION_CONSTANT = 0;
const int ALLOCATION_EQUATION8 = 1;
const int ALLOCATION_DEVIATION = 2;
const int ALLOCATION_RELATIVE = 3;

const float ALLOCATION_CHANCE = 0.5; // relative deviation beside that of the probes, which may agree by chance

const uint ALLOCATION_BINS = 4096u;
const float ALLOCATION_BINS_AN_OCTAVE = 32.0;
const float ALLOCATION_SPREAD = 4.0; // bins over which equal weights are spread
const float ALLOCATION_NONE = -64.0; // where the bins begin; no weight at all counts as this

// What samples of a bin get.
struct Share {
    float directions; // their logarithm to base 2, before they become powers of two
    uint first;       // place of the bin's first sample in the list, most directions first
};

float allocation_log(float weight) {
    return weight > 0.0 ? clamp(log2(weight), ALLOCATION_NONE, -ALLOCATION_NONE) : ALLOCATION_NONE;
}

// Logarithm of the weight of a sample by its entry in the list: the most of any block under the cell that it stands for (Bagher's
// section 3.1). `prediction` is as the bandwidth pass writes it, `side` a block's in samples.
float allocation_weight(sampler2D prediction, uint entry, int side, float by_level) {
    int l = list_level(entry);
    ivec2 cell = list_sample(entry) >> l << l, first = cell / side, last = (cell + (1 << l) - 1) / side;
    last = min(last, textureSize(prediction, 0) - 1);
    float most = ALLOCATION_NONE;
    for (int y = first.y; y <= last.y; ++y) {
        for (int x = first.x; x <= last.x; ++x) {
            vec4 found = texelFetch(prediction, ivec2(x, y), 0);
            most = max(most, found.w > 0.0 ? found.z : ALLOCATION_NONE);
        }
    }
    return most + by_level * float(l);
}

// Of a sample by its entry in the list.
uint allocation_bin(float log_weight, uint entry) {
    float spread = ALLOCATION_SPREAD * to_unit(hash(entry));
    float bin = floor((log_weight - ALLOCATION_NONE) * ALLOCATION_BINS_AN_OCTAVE + spread);
    return uint(int(clamp(bin, 0.0, float(ALLOCATION_BINS - 1u))));
}

float allocation_share(uint bin, float scale) {
    return scale + float(bin) / ALLOCATION_BINS_AN_OCTAVE;
}

// Two neighbouring powers of two, within `range`, and how far from the first to the second the directions of a bin are.
vec3 allocation_powers(float share, vec2 range) {
    float rounded = share + 0.5, lower = floor(rounded);
    vec2 powers = clamp(floor(exp2(clamp(vec2(lower, lower + 1.0), 0.0, 31.0)) + 0.5), range.x, range.y);
    return vec3(powers, clamp((rounded - lower - 1.0) * ALLOCATION_BINS_AN_OCTAVE + 1.0, 0.0, 1.0));
}

// Mean directions of the samples of a bin.
float allocation_expected(float share, vec2 range) {
    vec3 p = allocation_powers(share, range);
    return p.x + (p.y - p.x) * p.z;
}

// Directions of one of them: that mean, so that no sample is a large part of the budget off; a power of two in most bins.
uint allocation_directions(float share, vec2 range, uint entry) {
    return uint(int(floor(allocation_expected(share, range) + to_unit(hash(~entry)))));
}

#endif
