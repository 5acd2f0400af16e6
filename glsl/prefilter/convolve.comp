#version 460
// One level of the chain, or irradiance: at each texel the mean of the environment's light under a lobe, from a grid of nearly
// square texels (rings.glsl). Every texel within reach counts with its solid angle; weights are normalised, so that constant light
// stays so. Twin: src/distribution/prefilter.rs.
#include "rings.glsl"
#include "vmf.glsl"

layout(local_size_x = 64) in;
// Whether the lobe is a clamped cosine.
layout(constant_id = 0) const bool COSINE = false;
layout(set = 2, binding = 0, std430) readonly buffer Rings {
    vec4 rings[];
};
layout(set = 2, binding = 1, std430) writeonly buffer Chain {
    vec4 chain[];
};
layout(push_constant) uniform Push {
    int width;        // columns of what is written
    int to;           // its first texel
    int source_width; // columns of the grid that is read
    int from;         // its first texel
    float kappa;
    float blurred;    // variance of its texels, in squared texels
} push;

// A lobe ends where e^-REACH is left of it.
const float REACH = 9.0;

void main() {
    int columns = push.width, rows = columns >> 1;
    int x = int(gl_GlobalInvocationID.x), y = int(gl_WorkGroupID.y);
    float step_target = PI / float(rows), step_source = 2.0 * PI / float(push.source_width);
    // The coarsest level has half a row beyond each pole.
    float theta = (float(y) + 0.5) * step_target - float(columns) * (1.0 / 16.0) * step_target;
    if (x >= columns || theta < -step_target || theta > PI + step_target) {
        return;
    }
    float turn = (float(x) + 0.5) / float(columns);
    bool beyond = theta < 0.0 || theta > PI;
    theta = theta < 0.0 ? -theta : (theta > PI ? 2.0 * PI - theta : theta);
    turn += beyond ? 0.5 : 0.0;
    vec2 at = cos_sin(theta);

    // What texels of the source and look-ups blur already, the lobe need not: half the variance along the meridian, half across.
    int last = (push.source_width >> 1) - 1;
    int nearest = clamp(int(theta / step_source), 0, last);
    float side = at.y * float(push.source_width) / float(ring_texels(nearest, push.source_width));
    float blurred = 0.5 * push.blurred * step_source * step_source * (1.0 + side * side)
        + step_target * step_target * (1.0 / 12.0) * (1.0 + at.y * at.y);
    float kappa = vmf_before(push.kappa, blurred);
    float cos_reach = COSINE ? 0.0 : max(1.0 - REACH / kappa, -1.0);
    float reach = acos_full(cos_reach);
    int first_row = clamp(int((theta - reach) / step_source - 0.5), 0, last);
    int last_row = clamp(int((theta + reach) / step_source + 0.5), 0, last);

    vec4 sum = vec4(0.0);
    for (int row = first_row; row <= last_row; ++row) {
        float theta_row = (float(row) + 0.5) * step_source;
        float half_sine = cos_sin(0.5 * (theta - theta_row)).y;
        float apart = 2.0 * half_sine * half_sine; // 1 - cos of the difference
        float sine = cos_sin(theta_row).y;
        float across_scale = 2.0 * at.y * sine;    // 1 - cos of the distance = apart + across_scale sin^2(half the turn)
        float half_turn = (1.0 - apart - cos_reach) / max(across_scale, 1e-12);
        if (half_turn < 0.0) {
            continue;
        }
        int texels = ring_texels(row, push.source_width);
        float half_width = half_turn >= 1.0 ? 0.5 : acos_full(1.0 - 2.0 * half_turn) * (0.5 * INV_PI);
        int count = min(int(half_width * 2.0 * float(texels)) + 1, texels);
        float middle = turn * float(texels) - 0.5;
        int begin = int(ceil(middle - half_width * float(texels)));
        float weight_row = sine / float(texels);
        int line = push.from + row * push.source_width;
        float turn_step = PI / float(texels);
        vec4 sum_row = vec4(0.0);
        for (int i = 0; i < count; ++i) {
            float half_angle = (float(begin + i) - middle) * turn_step;
            float s = cos_sin(half_angle).y;
            float versine = apart + across_scale * s * s;
            float weight = COSINE ? max(1.0 - versine, 0.0) : exp(-kappa * versine);
            sum_row += vec4(rings[line + ((begin + i) & (texels - 1))].rgb, 1.0) * weight;
        }
        sum += sum_row * weight_row;
    }
    vec3 mean = sum.rgb / sum.w;
    chain[push.to + y * columns + x] = vec4(COSINE ? mean * PI : mean, 1.0);
}
