// How fast the maps of materials vary, place by place and at several scales. src/frequency/texture.rs is the f64 twin.
#ifndef TEXTURE_BANDWIDTH_GLSL
#define TEXTURE_BANDWIDTH_GLSL

const int TEXTURE_SIDE = 64; // cells a side of the finest grid
const int TEXTURE_LEVELS = 6; // above it

// Cells from the first of a material's, which is 0 and common to all without maps, in a grid of 64 x 64, of 32 x 32, … of one:
// of the place `uv` of the maps, and a footprint of `units` of their sides. A buffer, as a look-up costs less than in an image.
int texture_cell(int first, vec2 uv, float units) {
    int level = int(clamp(ceil(log2(max(units * float(TEXTURE_SIDE), 1e-9))), 0.0, float(TEXTURE_LEVELS)));
    int side = TEXTURE_SIDE >> level, all = 4 * TEXTURE_SIDE * TEXTURE_SIDE;
    ivec2 cell = min(ivec2(fract(vec2(uv.x, -uv.y)) * float(side)), side - 1);
    return first == 0 ? 0 : first + (all - (all >> (2 * level))) / 3 + cell.y * side + cell.x;
}

#endif
