#version 460
// Decides on the children of every block: shaded, or up-sampled from four parents whose weights it finds (Bagher 2011, section
// 3.2, with the rule that leaves no holes: a child without enough valid weight is shaded). A parent is valid where it has a
// value, and that depends on the pyramid alone, so all levels are decided at once. Twin: src/frequency/reconstruction.rs.
#include "frame.glsl"
#include "gbuffer.glsl"
#include "levels.glsl"
#include "list.glsl"

layout(local_size_x = LIST_GROUP) in;

layout(constant_id = 0) const int TOP = 3;

layout(set = 2, binding = 1, std430) readonly buffer Cells {
    Cell cells[];
};
layout(set = 2, binding = 2, std430) readonly buffer Blocks {
    Block blocks[];
};
layout(set = 2, binding = 3, std430) readonly buffer BlockArguments {
    uvec4 block_arguments[LEVELS];
};
layout(set = 2, binding = 4, std430) writeonly buffer Weights {
    uint weights[]; // four to a block
};
layout(set = 2, binding = 5, std430) buffer Arguments {
    uint groups_x, groups_y, groups_z; // of the indirect dispatch
    uint count;
} arguments;
layout(set = 2, binding = 6, std430) writeonly buffer List {
    uint list[];
};

// Distances from the surface's plane are weighted by a Gaussian of this many footprints of the child.
const float PLANE = 0.5;
// The valid share of the parents' weight that up-sampling takes.
const float ACCEPT = 0.5;

shared uint group_first;
shared uint group_count;

struct Parent {
    vec2 at; // the representative sample
    float depth;
    float inside; // 1 in the image, 0 out of it
    float valid;  // 1 where it has a value of the block's object
};

Parent parent(int l, ivec2 c, uint object) {
    ivec2 extent = frame.levels[l].xy;
    ivec2 q = clamp(c, ivec2(0), extent - 1);
    Cell cell = cells[cell_index(l, q)];
    uint level = cell_level(cell.word);
    bool inside = q == c;
    bool valid = inside && level != UNCOVERED && level >= uint(l) && cell_object(cell.word) == object;
    return Parent(vec2((q << l) + cell_place(cell.word)), cell.depth, inside ? 1.0 : 0.0, valid ? 1.0 : 0.0);
}

vec3 surface_normal(ivec2 p) {
    return gbuffer_normal(p);
}

// What the weights of a child at `at` are made of.
struct Child {
    vec2 at;
    float spacing;   // 1 over the parents' distance in samples
    float depth;
    float towards;   // n . ray through the child, at depth 1
    vec2 slope;      // its change a sample
    float sharpness; // of the Gaussian over squared plane distance
    vec3 facing;     // unit normal: screen right and down, and towards the viewer
};

Child child_at(ivec2 p, float side) {
    vec3 n = surface_normal(p);
    float depth = gbuffer_depth(p);
    vec2 a_sample = 2.0 * frame.ray.xy / vec2(frame.extent.xy);
    vec3 view = vec3(dot(n, frame.world_from_view[0].xyz), dot(n, frame.world_from_view[1].xyz), dot(n, frame.world_from_view[2].xyz));
    vec2 v = (vec2(p) + 0.5) * a_sample - frame.ray.xy + frame.ray.zw;
    float footprint = PLANE * depth * max(abs(a_sample.x), abs(a_sample.y)) * side;
    return Child(vec2(p), 0.5 / side, depth, dot(view.xy, v) - view.z, view.xy * a_sample, 0.5 / (footprint * footprint),
        vec3(view.xy * sign(a_sample), view.z));
}

// x: the weight w = g_z g_a alpha; y: the valid part g_z alpha that acceptance counts; z: alpha.
vec3 weight(Child c, Parent p) {
    vec2 d = p.at - c.at;
    vec2 tent = max(1.0 - abs(d) * c.spacing, 0.0);
    float alpha = tent.x * tent.y * p.inside;
    float plane = c.depth * c.towards - p.depth * (c.towards + dot(c.slope, d));
    float valid = alpha * exp(-plane * plane * c.sharpness) * p.valid;
    // M = R^T diag(1, cos^2) R over squared parent distances, with the projected normal along the first axis.
    vec2 e = d * c.spacing;
    float across = dot(e, c.facing.xy);
    return vec3(valid * exp(-(across * across + c.facing.z * c.facing.z * dot(e, e))), valid, alpha);
}

uint step_of(float part, float whole, float steps) {
    return uint(int(whole > 0.0 ? min(part / whole, 1.0) * steps + 0.5 : 0.0));
}

// A child's word. `state` is the pyramid's.
uint decide(uint state, ivec2 p, float side, Parent p0, Parent p1, Parent p2, Parent p3) {
    Child c = child_at(p, side);
    vec3 a = weight(c, p0), b = weight(c, p1), d = weight(c, p2), e = weight(c, p3);
    float valid = a.y + b.y + d.y + e.y, all_weight = a.z + b.z + d.z + e.z;
    uint word = step_of(b.x, a.x + b.x, 255.0) | step_of(e.x, d.x + e.x, 255.0) << 8
        | step_of(d.x + e.x, a.x + b.x + d.x + e.x, 255.0) << 16 | step_of(valid, all_weight, 63.0) << 24;
    bool accepted = valid >= ACCEPT * all_weight && a.x + b.x + d.x + e.x > 0.0;
    return state == CHILD_TRY ? word | (accepted ? FROM_PARENTS : FROM_SHADING) : state == CHILD_SHADE ? FROM_SHADING : 0u;
}

uint shaded(uint word) {
    return word >> 30 & 1u;
}

void main() {
    uint index = list_index();
    bool work = index < block_arguments[0].w;
    int l = 1;
    for (int k = 1; k < TOP; ++k) {
        uint n = block_arguments[k].w;
        if (l == k && index >= n) {
            index -= n;
            l = k + 1;
        }
    }
    uint slot = uint(frame.levels[l].z) + index;
    Block block = Block(0u, 0u);
    if (work) {
        block = blocks[slot];
    }
    ivec2 cell = ivec2(block.cell & 0xffffu, block.cell >> 16);
    uint own = cells[cell_index(l, cell)].word;
    uint object = cell_object(own);
    Parent p0 = parent(l, cell + ivec2(-1, -1), object), p1 = parent(l, cell + ivec2(0, -1), object), p2 = parent(l, cell + ivec2(1, -1), object);
    Parent p3 = parent(l, cell + ivec2(-1, 0), object), p4 = parent(l, cell, object), p5 = parent(l, cell + ivec2(1, 0), object);
    Parent p6 = parent(l, cell + ivec2(-1, 1), object), p7 = parent(l, cell + ivec2(0, 1), object), p8 = parent(l, cell + ivec2(1, 1), object);

    // The children's representative samples; lanes without work, and children that are no cells, read one common place.
    ivec2 at[4];
    uvec4 states = uvec4(block.children, block.children >> 2, block.children >> 4, block.children >> 6) & 3u;
    for (int k = 0; k < 4; ++k) {
        ivec2 c = states[k] == CHILD_NONE ? ivec2(0) : cell * 2 + ivec2(k & 1, k >> 1);
        at[k] = c;
        if (TOP != 1) {
            ivec2 place = cell_place(cells[l > 1 ? cell_index(l - 1, c) : 0].word);
            at[k] = l > 1 ? (c << (l - 1)) + place : c;
        }
    }
    float side = float(1 << (l - 1));
    uvec4 words;
    words.x = decide(states.x, at[0], side, p0, p1, p3, p4);
    words.y = decide(states.y, at[1], side, p1, p2, p4, p5);
    words.z = decide(states.z, at[2], side, p3, p4, p6, p7);
    words.w = decide(states.w, at[3], side, p4, p5, p7, p8);
    bool itself = (block.children & ITSELF) != 0u;
    uint n = shaded(words.x) + shaded(words.y) + shaded(words.z) + shaded(words.w) + (itself ? 1u : 0u);

    if (gl_LocalInvocationIndex == 0u) {
        group_count = 0u;
    }
    barrier();
    uint first = atomicAdd(group_count, n);
    barrier();
    if (gl_LocalInvocationIndex == 0u && group_count > 0u) {
        group_first = atomicAdd(arguments.count, group_count);
        uint groups = (group_first + group_count + LIST_GROUP - 1u) / LIST_GROUP;
        atomicMax(arguments.groups_x, min(groups, LIST_ROW));
        atomicMax(arguments.groups_y, (groups + LIST_ROW - 1u) / LIST_ROW);
    }
    barrier();
    first += group_first;
    if (itself) {
        list[first++] = list_entry((cell << l) + cell_place(own), l);
    }
    for (int k = 0; k < 4; ++k) {
        if (work) {
            weights[4u * slot + uint(k)] = words[k];
        }
        if (shaded(words[k]) != 0u) {
            list[first++] = list_entry(at[k], l - 1);
        }
    }
}
