// Filters of which a look-up finds lobes that are not averaged: those fitted to each of the texels that it reads, or those of base
// texels below it. A lobe's mass is its weight over its mean cosine. Part of filter.comp.

void keep_mass(ivec2 p, inout Found f, MapRecord record, vec3 mu, float kappa, float mass, vec3 normal, inout vec4 sum) {
    f.area = record.facing;
    keep(p, f, mu, kappa, mass, record.upright != 0u ? mu : normal);
    sum += vec4(mu, 1.0) * mass;
}

// The peaks of four texels of each of two levels; below the first the lobes of base texels.
void decode_peaks(ivec2 p, MapRecord record, vec2 uv, Reach r, uint lobe_layer, inout Found f) {
    vec3 normal = record.upright != 0u ? vec3(0.0) : look_up(MOMENT_CLASSES, record.moments, 0u, uv, r).xyz;
    vec4 sum = vec4(0.0);
    float level = floor(max(r.level - 1.0, 0.0)), between = max(r.level - 1.0, 0.0) - level, coarse = min(r.level, 1.0);
    for (uint side = 0u; side < 3u; ++side) {
        bool base = side == 2u;
        float of_level = base ? 1.0 - coarse : coarse * (side == 0u ? 1.0 - between : between);
        vec2 size = base ? r.size : max(vec2(uvec2(r.size) >> (1u + uint(level) + side)), vec2(1.0));
        vec2 place = vec2(uv.x, 1.0 - uv.y) * size - 0.5, first = floor(place), part = place - first;
        for (uint k = 0u; k < (of_level > 0.0 ? 4u : 0u); ++k) {
            vec2 corner = vec2(k & 1u, k >> 1), share = mix(1.0 - part, part, corner);
            vec2 centre = (first + corner + 0.5) / size;
            centre.y = 1.0 - centre.y;
            float weight = share.x * share.y * of_level;
            vec3 below = vec3(0.0);
            for (uint j = record.upright; j < (base ? 1u : 0u); ++j) {
                below = fetch(MOMENT_CLASSES, record.moments, 0u, centre, 0.0).xyz;
            }
            for (uint j = 0u; j < (base ? record.count : 0u); ++j) {
                vec4 lobe = fetch(MOMENT_CLASSES, record.moments, lobe_layer + j, centre, 0.0);
                keep_mass(p, f, record, lobe.xyz, lobe.w, weight * record.weights[j] / moments_area(lobe.w, record.lobes), below, sum);
            }
            for (uint j = 0u; j < (base ? 0u : filter_peaks(FILTER)); ++j) {
                vec4 peak = fetch(CELL_CLASSES, record.cells, j, centre, level + float(side));
                vec3 mu = oct_decode(peak.xy);
                for (uint k = record.upright; k < 1u; ++k) {
                    vec3 n = oct_decode(fetch(CELL_CLASSES, record.cells, filter_peaks(FILTER) + j, centre, level + float(side)).xy);
                    below = vec3(n.xy, 1.0 - n.z);
                }
                keep_mass(p, f, record, vec3(mu.xy, 1.0 - mu.z), peak.z, weight * peak.w, below, sum);
            }
        }
    }
    f.mean = record.upright != 0u ? sum.xyz / max(sum.w, LEAST_WEIGHT) : normal;
}

// Steps of an even sequence in three dimensions (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences"), times 2^32.
const uvec3 EVEN_STEPS = uvec3(3518319149u, 2882110339u, 2360945581u);

// Lobes of some of the base texels below, drawn as the look-ups weigh them.
void decode_base(ivec2 p, MapRecord record, vec2 uv, Reach r, uint lobe_layer, inout Found f) {
    vec3 normal = record.upright != 0u ? vec3(0.0) : look_up(MOMENT_CLASSES, record.moments, 0u, uv, r).xyz;
    vec4 sum = vec4(0.0);
    uint texels = LOBES / max(record.count, 1u), seed = hash((uint(p.x) | uint(p.y) << 16) ^ hash(frame.sampling.x));
    uvec3 start = uvec3(seed, hash(seed ^ 0x9e3779b9u), hash(seed ^ 0x7f4a7c15u));
    for (uint i = 0u; i < (record.count > 0u ? texels : 0u); ++i) {
        uvec3 even = start + (frame.sampling.y * texels + i) * EVEN_STEPS;
        float tap = to_unit(even.z) * r.taps, whole = floor(r.level);
        float level = whole + (fract(tap) < r.level - whole ? 1.0 : 0.0);
        vec2 at = reach_tap(r, uv, floor(tap));
        vec2 size = max(vec2(uvec2(r.size) >> uint(min(level, 31.0))), vec2(1.0));
        vec2 place = vec2(at.x, 1.0 - at.y) * size - 0.5, first = floor(place), part = place - first;
        // The one texel or the next, and a place in it.
        vec2 u = vec2(to_unit(even.x), to_unit(even.y));
        bvec2 next = greaterThanEqual(u, 1.0 - part);
        vec2 inside = mix(u / max(1.0 - part, 1e-6), (u - (1.0 - part)) / max(part, 1e-6), next);
        vec2 texel = floor(fract((first + vec2(next) + clamp(inside, 0.0, 0.999999)) / size) * r.size);
        vec2 centre = (texel + 0.5) / r.size;
        centre.y = 1.0 - centre.y;
        vec3 below = vec3(0.0);
        for (uint j = record.upright; j < 1u; ++j) {
            below = fetch(MOMENT_CLASSES, record.moments, 0u, centre, 0.0).xyz;
        }
        for (uint j = 0u; j < record.count; ++j) {
            vec4 lobe = fetch(MOMENT_CLASSES, record.moments, lobe_layer + j, centre, 0.0);
            float weight = record.weights[j] / float(texels);
            keep_mass(p, f, record, lobe.xyz, lobe.w, weight / moments_area(lobe.w, record.lobes), below, sum);
        }
    }
    f.mean = record.upright != 0u ? sum.xyz / max(sum.w, LEAST_WEIGHT) : normal;
}
