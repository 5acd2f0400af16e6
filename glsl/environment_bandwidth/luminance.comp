#version 460
// Luminance over its mean, cut where it is brighter than any display shows, on a grid whose sides are powers of two.
// src/frequency/environment.rs is the f64 twin.
layout(local_size_x = 8, local_size_y = 8) in;
// Whether the environment has the grid's size.
layout(constant_id = 0) const bool SAME_SIZE = true;
layout(set = 2, binding = 0) uniform sampler2D environment;
layout(set = 2, binding = 1, r32f) uniform writeonly image2D luminance;
layout(push_constant) uniform Push { float scale; };

const float BRIGHTEST = 10.0;

float light(ivec2 p) {
    return min(dot(texelFetch(environment, p, 0).rgb, vec3(0.2126, 0.7152, 0.0722)) * scale, BRIGHTEST);
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy), size = imageSize(luminance);
    if (any(greaterThanEqual(p, size))) {
        return;
    }
    float l;
    if (SAME_SIZE) {
        l = light(p);
    } else {
        ivec2 from = textureSize(environment, 0);
        vec2 at = (vec2(p) + 0.5) * vec2(from) / vec2(size) - 0.5;
        ivec2 a = ivec2(floor(at)), b = a + 1;
        vec2 f = at - floor(at);
        a = ivec2(a.x < 0 ? a.x + from.x : a.x, max(a.y, 0));
        b = ivec2(b.x >= from.x ? b.x - from.x : b.x, min(b.y, from.y - 1));
        l = mix(mix(light(a), light(ivec2(b.x, a.y)), f.x), mix(light(ivec2(a.x, b.y)), light(b), f.x), f.y);
    }
    imageStore(luminance, p, vec4(l));
}
