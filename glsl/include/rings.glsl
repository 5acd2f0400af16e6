// A sphere of rows whose number of texels falls with their length, so that texels are nearly square: row i of a grid of `width`
// columns and half as many rows has width >> k texels, each 2^k columns wide, and at least 4.
#ifndef RINGS_GLSL
#define RINGS_GLSL
#include "angles.glsl"

int ring_texels(int row, int width) {
    float theta = (float(row) + 0.5) * (2.0 * PI) / float(width);
    return width >> int(-log2(cos_sin(theta).y));
}

#endif
