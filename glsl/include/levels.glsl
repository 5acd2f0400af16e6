// Levels of shading: a cell of level l is 2^l x 2^l samples, cells of level 0 are samples. Twin: src/frequency/reconstruction.rs.
#ifndef LEVELS_GLSL
#define LEVELS_GLSL

// frame.levels[l]: cells across and down; the first of its cells among those of levels 1, 2, …; its first row in the image
// that holds its values: one for even levels, one for odd ones.
const int LEVELS = 6;

// A cell of a level above 0, from its covered samples: their least level | the representative sample's place in the cell,
// x << 3 | y << 8 | the representative's object << 16; and the representative's depth.
struct Cell {
    uint word;
    float depth;
};
const uint UNCOVERED = 7u; // the least level where no sample is covered

uint cell_level(uint word) {
    return word & 7u;
}

ivec2 cell_place(uint word) {
    return ivec2(word >> 3, word >> 8) & 31;
}

uint cell_object(uint word) {
    return word >> 16;
}

int cell_index(int l, ivec2 cell) {
    return frame.levels[l].z + cell.y * frame.levels[l].x + cell.x;
}

// What the pyramid finds for each child of a cell of level l, two bits each.
const uint CHILD_NONE = 0u;  // uncovered, or finer than level l - 1
const uint CHILD_SHADE = 1u; // at level l - 1, or without a parent of its own to read
const uint CHILD_TRY = 2u;   // up-sampled where enough of the parents' weight is valid
const uint ITSELF = 256u;    // beside the children: the cell is of the coarsest level and is shaded

// A cell with children to decide on.
struct Block {
    uint cell; // y << 16 | x
    uint children;
};

// What a child takes from its four parents: three steps of 1/255 between them, left to right at the top and at the bottom,
// then top to bottom, << 0, 8 and 16; the valid share of their weight in steps of 1/63 << 24; and where its value comes from.
const uint FROM_SHADING = 1u << 30;
const uint FROM_PARENTS = 2u << 30;

#endif
