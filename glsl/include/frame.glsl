// What every pass knows of the frame (src/pass/mod.rs, struct FrameUniform).
#ifndef FRAME_GLSL
#define FRAME_GLSL

layout(set = 2, binding = 0, std140) uniform Frame {
    vec4 world_from_view[3]; // columns; the view looks along its own -z
    vec4 eye;                // world position
    vec4 ray;                // view x, y at unit depth = ndc * ray.xy + ray.zw
    uvec4 extent;            // shading width, height; samples a side of an output pixel; environment visible
    uvec4 sampling;          // seed, frame, samples a shaded pixel
    vec4 environment;        // rotation in turns, intensity
    uvec4 lights;            // exact lights, then area lights; masks of lights
    ivec4 levels[6];         // of shading: see levels.glsl
} frame;

// World vector from the eye through the centre of shading sample p, of length 1 along the view axis.
vec3 frame_ray(ivec2 p) {
    vec2 ndc = (vec2(p) + 0.5) / vec2(frame.extent.xy) * 2.0 - 1.0;
    vec2 v = ndc * frame.ray.xy + frame.ray.zw;
    return frame.world_from_view[0].xyz * v.x + frame.world_from_view[1].xyz * v.y - frame.world_from_view[2].xyz;
}

#endif
