// How a list of samples is spread over an indirect dispatch: groups of LIST_GROUP entries, LIST_ROW groups a row; and what its entries are.
#ifndef LIST_GLSL
#define LIST_GLSL

const uint LIST_GROUP = 64u;
const uint LIST_ROW = 32768u; // below every device's limit on groups in x

// Tiles down in a stripe of the list of all samples: groups are so many in x, tiles across in y and stripes in z.
const uint STRIPE = 4u;

uint list_index() {
    return (gl_WorkGroupID.y * LIST_ROW + gl_WorkGroupID.x) * LIST_GROUP + gl_LocalInvocationIndex;
}

// An entry of the list of samples to shade: the sample and the level of the cell that it represents.
uint list_entry(ivec2 p, int l) {
    return uint(p.x) | uint(p.y) << 14 | uint(l) << 28;
}

ivec2 list_sample(uint entry) {
    return ivec2(entry & 0x3fffu, entry >> 14 & 0x3fffu);
}

int list_level(uint entry) {
    return int(entry >> 28);
}

#endif
