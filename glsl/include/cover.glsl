// What a texel of a coarser map covers of a finer one: src/texture/chain.rs is the twin. One axis at a time.
#ifndef COVER_GLSL
#define COVER_GLSL

// In units of 1/to of a texel, whole numbers: from where to where, and the first and the last texel.
struct Cover {
    int start;
    int end;
    int first;
    int last;
};

// Of texel i of `to` over `from`, both sides up to 16384.
Cover cover(int i, int from, int to) {
    int start = i * from, end = start + from;
    return Cover(start, end, start / to, (end - 1) / to);
}

// The share of one of the texels.
float cover_share(Cover c, int texel, int from, int to) {
    return float(min(c.end, (texel + 1) * to) - max(c.start, texel * to)) / float(from);
}

#endif
