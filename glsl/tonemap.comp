#version 460
// Writes the host's output: linear radiance as it is, or exposed, clamped and encoded as sRGB.
// variant: rgba8 FORMAT=rgba8
// variant: rgba16f FORMAT=rgba16f
// variant: rgba32f FORMAT=rgba32f

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 2, binding = 0) uniform sampler2D resolved;
layout(set = 2, binding = 1, FORMAT) uniform writeonly image2D target;

layout(push_constant) uniform Push {
    float exposure;
    uint srgb;
} push;

vec3 srgb_encode(vec3 c) {
    c = clamp(c, 0.0, 1.0);
    return mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, lessThanEqual(c, vec3(0.0031308)));
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, imageSize(target)))) {
        return;
    }
    vec4 c = texelFetch(resolved, p, 0);
    c.rgb *= push.exposure;
    imageStore(target, p, push.srgb != 0u ? vec4(srgb_encode(c.rgb), c.a) : c);
}
