// What is known of the blocks of samples before all of them are predicted, and the groups of the passes that follow.
#ifndef FORECAST_GLSL
#define FORECAST_GLSL

struct Forecast {
    uint blocks_x, blocks_y, blocks_z; // groups over all blocks with a surface
    uint shaded;                       // forecast, in 1/64 of a block, among the blocks that were looked at first
    uint cells_x, cells_y, cells_z;    // groups of the pyramid
    uint covered;                      // blocks that were looked at first
    uint samples_x, samples_y, samples_z; // groups of the list of all samples
    uint groups;                       // done, of those that look first
    uint first_x, first_y, first_z;    // groups over the blocks to look at first
    uint first;                        // their number
    uint blocks;                       // number of all blocks with a surface
};

// An entry of the list of blocks: the block, and which of its samples, row by row, stands for it.
uint block_entry(ivec2 block, int k) {
    return uint(block.x) | uint(block.y) << 13 | uint(k) << 26;
}

ivec2 block_place(uint entry) {
    return ivec2(entry & 0x1fffu, entry >> 13 & 0x1fffu);
}

int block_sample(uint entry) {
    return int(entry >> 26);
}

#endif
