// How a list of samples is spread over an indirect dispatch: groups of LIST_GROUP entries, LIST_ROW groups a row.
#ifndef LIST_GLSL
#define LIST_GLSL

const uint LIST_GROUP = 64u;
const uint LIST_ROW = 32768u; // below every device's limit on groups in x

// Tiles down in a stripe of the list of all samples: groups are so many in x, tiles across in y and stripes in z.
const uint STRIPE = 4u;

uint list_index() {
    return (gl_WorkGroupID.y * LIST_ROW + gl_WorkGroupID.x) * LIST_GROUP + gl_LocalInvocationIndex;
}

#endif
