#version 460
// What samples of each bin get, so that their mean is the budget: one group bisects for the factor on all weights. Sums are taken
// over a fixed tree.
#include "allocation.glsl"

const uint LANES = 128u;
const uint OWN = ALLOCATION_BINS / LANES; // bins of a lane
layout(local_size_x = LANES) in;

layout(set = 2, binding = 0, std430) readonly buffer Histogram {
    uint histogram[ALLOCATION_BINS];
};
layout(set = 2, binding = 1, std430) writeonly buffer Shares {
    Share shares[ALLOCATION_BINS];
};

layout(push_constant) uniform Push {
    vec2 range;   // fewest and most directions of a sample
    float budget; // their mean
} push;

shared float partial[LANES];
shared uint counts[LANES];

// Over all lanes.
float sum(float value) {
    uint lane = gl_LocalInvocationIndex;
    barrier();
    partial[lane] = value;
    for (uint half_ = LANES / 2u; half_ > 0u; half_ /= 2u) {
        barrier();
        if (lane < half_) {
            partial[lane] += partial[lane + half_];
        }
    }
    barrier();
    return partial[0];
}

void main() {
    uint lane = gl_LocalInvocationIndex, first_bin = lane * OWN;
    uint own[OWN], all = 0u;
    for (uint k = 0u; k < OWN; ++k) {
        own[k] = histogram[first_bin + k];
        all += own[k];
    }
    float target = push.budget * sum(float(all));
    // All at the least, all at the most.
    float low = log2(push.range.x) + 2.0 * ALLOCATION_NONE - 2.0, high = log2(push.range.y) + 2.0;
    for (int i = 0; i < 32; ++i) {
        float middle = 0.5 * (low + high), directions = 0.0;
        for (uint k = 0u; k < OWN; ++k) {
            directions += float(own[k]) * allocation_expected(allocation_share(first_bin + k, middle), push.range);
        }
        bool below = sum(directions) < target;
        low = below ? middle : low;
        high = below ? high : middle;
    }
    counts[lane] = all;
    barrier();
    uint first = 0u; // samples of heavier bins
    for (uint l = lane + 1u; l < LANES; ++l) {
        first += counts[l];
    }
    for (uint k = OWN; k-- > 0u;) {
        shares[first_bin + k] = Share(allocation_share(first_bin + k, high), first);
        first += own[k];
    }
}
