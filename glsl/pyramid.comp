#version 460
// Cells of levels 1 to TOP from the levels of covered samples: the least level (Bagher 2011, section 3.1) and the sample that
// stands for the cell; and the blocks, cells with children that may be shaded or up-sampled. The order of blocks depends on
// scheduling; nothing that reads them depends on it.
#include "frame.glsl"
#include "gbuffer.glsl"
#include "levels.glsl"
#include "list.glsl"

// An invocation makes a cell of level 2 and its children; a group goes on to level 5.
layout(local_size_x = 8, local_size_y = 8) in;

layout(constant_id = 0) const int TOP = 3; // `TOP / l != 0` is TOP >= l in operations that reflection libraries evaluate

layout(set = 2, binding = 1) uniform usampler2D level; // of each sample
layout(set = 2, binding = 2, std430) writeonly buffer Cells {
    Cell cells[]; // level after level
};
layout(set = 2, binding = 3, std430) writeonly buffer Blocks {
    Block blocks[]; // of level l from frame.levels[l].z on
};
layout(set = 2, binding = 4, std430) buffer BlockArguments {
    uvec4 arguments[LEVELS]; // groups in x, y, z and count: 0 of all levels, l of level l
};

shared Cell below[64 + 16 + 4];
shared uint counts[LEVELS];
shared uint firsts[LEVELS];

struct Found {
    Cell cell;
    uint children;
};

// A cell of level l from its children's: the representative is the one of theirs that is nearest to the middle.
Found found(int l, Cell c0, Cell c1, Cell c2, Cell c3) {
    Cell children[4] = Cell[4](c0, c1, c2, c3);
    int side = 1 << (l - 1);
    uint least = UNCOVERED;
    int nearest = 1 << 16;
    ivec2 place = ivec2(side);
    uint object = 0u;
    float depth = 0.0;
    for (int k = 0; k < 4; ++k) {
        uint word = children[k].word;
        least = min(least, cell_level(word));
        ivec2 at = cell_place(word) + ivec2(k & 1, k >> 1) * side;
        ivec2 d = at - side;
        int distance = cell_level(word) == UNCOVERED ? 1 << 16 : d.x * d.x + d.y * d.y;
        bool nearer = distance < nearest;
        nearest = min(nearest, distance);
        place = nearer ? at : place;
        object = nearer ? cell_object(word) : object;
        depth = nearer ? children[k].depth : depth;
    }
    bool whole = least >= uint(l);
    uint states = l == TOP && whole && least != UNCOVERED ? ITSELF : 0u;
    for (int k = 0; k < 4; ++k) {
        uint word = children[k].word;
        uint state = whole ? (cell_object(word) == object ? CHILD_TRY : CHILD_SHADE)
                           : (cell_level(word) + 1u >= uint(l) ? CHILD_SHADE : CHILD_NONE);
        states |= (cell_level(word) == UNCOVERED ? CHILD_NONE : state) << (2 * k);
    }
    return Found(Cell(least | uint(place.x) << 3 | uint(place.y) << 8 | object << 16, depth), states);
}

Cell sample_at(ivec2 p) {
    ivec2 q = min(p, ivec2(frame.extent.xy) - 1);
    uint finest = min(texelFetch(level, q, 0).x, uint(TOP));
    bool covered = q == p && gbuffer_covered(q);
    return Cell(covered ? finest | gbuffer_object(q) << 16 : UNCOVERED, 0.0);
}

// Level 1 of the cell at c.
Found finest_cell(ivec2 c) {
    ivec2 p = c * 2;
    Found f = found(1, sample_at(p), sample_at(p + ivec2(1, 0)), sample_at(p + ivec2(0, 1)), sample_at(p + 1));
    // Lanes without a surface read one common place.
    f.cell.depth = gbuffer_depth(cell_level(f.cell.word) == UNCOVERED ? ivec2(0) : p + cell_place(f.cell.word));
    return f;
}

uint count(Found f) {
    return f.children != 0u ? 1u : 0u;
}

// Writes the cell at c, if it is one, and its block behind `slot` others of the group.
void write(int l, ivec2 c, Found f, bool lane, inout uint slot) {
    if (lane && all(lessThan(c, frame.levels[l].xy))) {
        cells[cell_index(l, c)] = f.cell;
    }
    if (lane && f.children != 0u) {
        blocks[uint(frame.levels[l].z) + firsts[l] + slot] = Block(uint(c.y) << 16 | uint(c.x), f.children);
        slot += 1u;
    }
}

void main() {
    ivec2 group = ivec2(gl_WorkGroupID.xy), local = ivec2(gl_LocalInvocationID.xy);
    int lane = int(gl_LocalInvocationIndex);
    if (lane < LEVELS) {
        counts[lane] = 0u;
    }
    ivec2 c2 = group * 8 + local, c1 = c2 * 2;
    Found f0 = finest_cell(c1), f1 = finest_cell(c1 + ivec2(1, 0)), f2 = finest_cell(c1 + ivec2(0, 1)), f3 = finest_cell(c1 + 1);
    barrier();
    uint slots[LEVELS];
    slots[1] = atomicAdd(counts[1], count(f0) + count(f1) + count(f2) + count(f3));
    Found up[LEVELS];
    if (TOP / 2 != 0) {
        up[2] = found(2, f0.cell, f1.cell, f2.cell, f3.cell);
        slots[2] = atomicAdd(counts[2], count(up[2]));
        below[lane] = up[2].cell;
    }
    // Above, the first lanes of the group go on: 16, 4, 1, each with four neighbours of the level below.
    if (TOP / 3 != 0) {
        barrier();
        int k = (lane & 3) * 2 + (lane >> 2 & 3) * 16;
        up[3] = found(3, below[k], below[k + 1], below[k + 8], below[k + 9]);
        if (lane < 16) {
            slots[3] = atomicAdd(counts[3], count(up[3]));
            below[64 + lane] = up[3].cell;
        }
    }
    if (TOP / 4 != 0) {
        barrier();
        int k = 64 + (lane & 1) * 2 + (lane >> 1 & 1) * 8;
        up[4] = found(4, below[k], below[k + 1], below[k + 4], below[k + 5]);
        if (lane < 4) {
            slots[4] = atomicAdd(counts[4], count(up[4]));
            below[80 + lane] = up[4].cell;
        }
    }
    if (TOP / 5 != 0) {
        barrier();
        up[5] = found(5, below[80], below[81], below[82], below[83]);
        if (lane == 0) {
            slots[5] = atomicAdd(counts[5], count(up[5]));
        }
    }
    barrier();
    if (lane <= TOP) {
        // Lane l adds up level l, lane 0 all of them.
        uint n = counts[lane];
        for (int l = 1; l <= TOP && lane == 0; ++l) {
            n += counts[l];
        }
        if (n > 0u) {
            uint first = atomicAdd(arguments[lane].w, n);
            uint groups = (first + n + LIST_GROUP - 1u) / LIST_GROUP;
            atomicMax(arguments[lane].x, min(groups, LIST_ROW));
            atomicMax(arguments[lane].y, (groups + LIST_ROW - 1u) / LIST_ROW);
            firsts[lane] = first;
        }
    }
    barrier();
    write(1, c1, f0, true, slots[1]);
    write(1, c1 + ivec2(1, 0), f1, true, slots[1]);
    write(1, c1 + ivec2(0, 1), f2, true, slots[1]);
    write(1, c1 + 1, f3, true, slots[1]);
    if (TOP / 2 != 0) {
        write(2, c2, up[2], true, slots[2]);
    }
    if (TOP / 3 != 0) {
        write(3, group * 4 + ivec2(lane & 3, lane >> 2), up[3], lane < 16, slots[3]);
    }
    if (TOP / 4 != 0) {
        write(4, group * 2 + ivec2(lane & 1, lane >> 1), up[4], lane < 4, slots[4]);
    }
    if (TOP / 5 != 0) {
        write(5, group, up[5], lane == 0, slots[5]);
    }
}
