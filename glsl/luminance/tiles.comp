#version 460
// Of each tile of 8x8 output pixels of the frame before: mean luminance, error of half the resolution, sum and coverage.
// src/frequency/luminance.rs is the f64 twin.
#include "frame.glsl"
#include "luminance.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 2, binding = 1) uniform sampler2D previous;
layout(set = 2, binding = 2, std430) writeonly buffer Tiles {
    vec4 tiles[];
};

const int TILE = 8;

vec2 light(ivec2 p) {
    vec4 c = texelFetch(previous, p, 0);
    return vec2(luminance(c.rgb), c.a);
}

void main() {
    ivec2 extent = ivec2(frame.extent.xy) / int(frame.extent.z), last = extent - 1;
    ivec2 tile = ivec2(gl_GlobalInvocationID.xy), first = tile * TILE;
    if (any(greaterThanEqual(first, extent))) {
        return;
    }
    // Pixels outside repeat the last ones and do not count.
    vec2 row[TILE];
    for (int x = 0; x < TILE; ++x) {
        row[x] = light(min(first + ivec2(x, 0), last));
    }
    vec2 sum = vec2(0.0), squares = vec2(0.0);
    for (int y = 0; y < TILE; ++y) {
        vec2 next = light(min(first + ivec2(TILE, y), last));
        for (int x = TILE - 1; x >= 0; --x) {
            vec2 here = row[x], below = light(min(first + ivec2(x, y + 1), last));
            vec2 change = vec2(next.x, below.x) - here.x;
            bool inside = first.x + x < extent.x && first.y + y < extent.y;
            squares += inside ? change * change : vec2(0.0);
            sum += inside ? here : vec2(0.0);
            next = here;
            row[x] = below;
        }
    }
    ivec2 size = min(extent - first, TILE);
    float count = float(size.x * size.y);
    // Half of the difference of the two pixels that become one; cells are square, so that the worse direction counts.
    float error = 0.5 * sqrt(max(squares.x, squares.y) / count);
    tiles[tile.y * ((extent.x + TILE - 1) / TILE) + tile.x] = vec4(sum.x / count, error, sum);
}
