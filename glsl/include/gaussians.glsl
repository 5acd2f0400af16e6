// The Gaussians of what a pixel covers (src/distribution/gaussians.rs is the f64 twin): of each the moments mass, mass times place in the
// stereographic plane from the map's middle, mass times the mean square of this. What they share is, in `MapRecord::clusters`, the
// middle, the least variance, and the mean of 1 / kappa of the map's lobes. Part of filter.comp.

const uint GAUSSIANS = 4u;

void decode_gaussians(ivec2 p, MapRecord record, vec2 uv, Reach r, inout Found f) {
    vec4 shared_of = uintBitsToFloat(record.clusters);
    bool upright = record.upright != 0u;
    vec3 normal = upright ? vec3(0.0) : look_up(MOMENT_CLASSES, record.moments, 0u, uv, r).xyz;
    vec3 sum = vec3(0.0);
    float mass = 0.0;
    f.area = record.facing;
    for (uint i = 0u; i < GAUSSIANS; ++i) {
        vec4 moments = look_up(CELL_CLASSES, record.cells, i, uv, r);
        float q = moments.x;
        if (q > LEAST_WEIGHT) {
            vec2 off = moments.yz / q;
            float variance = max(0.5 * (moments.w / q - dot(off, off)), shared_of.z);
            vec2 s = shared_of.xy + off;
            float scale = stereographic_scale(s);
            vec3 mu = stereographic_direction(s), x, y, below = mu;
            tangent_basis(moments_direction(mu), x, y);
            if (!upright) {
                below = stereographic_direction(look_up(CELL_CLASSES, record.cells, GAUSSIANS + i, uv, r).xy / q);
            }
            keep_ellipse(p, f, Ellipse(mu, x, scale * scale / variance, 1.0), q, shared_of.w, below, 0u);
            sum += mu * q;
            mass += q;
        }
    }
    f.mean = upright ? sum / max(mass, LEAST_WEIGHT) : normal;
}
