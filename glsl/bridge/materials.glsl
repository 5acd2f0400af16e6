// The accessors through which every pass reads materials. A host with its own reflectance replaces this file.
// Local frame: z is the normal, the viewer is in the half plane y = 0, x >= 0. Kinds that are not isotropic turn it into the
// surface's tangent frame.
#ifndef BRIDGE_MATERIALS_GLSL
#define BRIDGE_MATERIALS_GLSL
#include "half_vector.glsl"
#include "ggx.glsl"
#include "blinn_phong.glsl"
#include "cavity.glsl"
#include "vmf.glsl"
#include "factors.glsl"

// Whether a filter widens lobes: a pass that reads what the filter wrote defines it as its specialization constant.
#ifndef MATERIAL_KERNEL
#define MATERIAL_KERNEL false
#endif

// A bit for each kind of reflectance that there may be: a pass that is compiled for those that there are defines it as its
// specialization constant.
#ifndef MATERIAL_KINDS
#define MATERIAL_KINDS 31u
#endif

const uint REFLECTANCE_TABLE = 0u;
const uint REFLECTANCE_GGX = 1u;
const uint REFLECTANCE_BLINN_PHONG = 2u;
const uint REFLECTANCE_VMF = 3u;
const uint REFLECTANCE_TURNED = 4u;
const uint REFLECTANCE_TABLES = 1u << REFLECTANCE_TABLE | 1u << REFLECTANCE_TURNED; // as bits

// Table resolution (MERL) and importance table layout (src/reflectance/importance.rs).
const vec3 TABLE_SIZE = vec3(180.0, 90.0, 90.0); // phi_d, theta_d, theta_h
// With less, a mixture of lobes would face away from its normal.
const float LEAST_PROJECTED_AREA = 0.05;
const uint IMPORTANCE_ANGLES = 64u;
const uint IMPORTANCE_ROWS = 64u;
const uint IMPORTANCE_COLUMNS = 16u;
const vec2 DENSITY_SIZE = vec2(16.0, 64.0); // cos(phi_h), warped theta_h
// Least distance in texels from the edge of a table in the atlas: the outermost bins' centres, and more than the rounding of a
// coordinate can miss them by in an atlas of 5 x 5 tables; larger ones have a wider border. The neighbour's values may be a million times higher.
const float TABLE_BORDER = 0.5 + 1.0 / 8192.0;

// By kind:           table               GGX              Blinn-Phong         vMF                turned tables
//   kind.yz          place in the atlas                                       first lobe, lobes  first table, tables
//   f0               1; -                F0; alpha        specular; exponent  1; mean z of lobes 1; tables per radian
//   albedo           w: scale            albedo           albedo              1; 2 / sharpest    w: scale
// A lobe is a record of its own: mean direction and concentration in f0, its density at the centre and its weight in albedo.xy.
struct MaterialRecord {
    uvec4 kind;      // x: kind of reflectance
    vec4 f0;
    vec4 albedo;
    vec4 importance; // first of its importance tables; the number of the last step; log2 of alpha squared of the first; steps per log2
    vec4 texture_bandwidth; // x: first of its maps' cells in texture_bandwidth.glsl, 0 without maps; yz: tiling
};

layout(set = 1, binding = 0, std430) readonly buffer Materials {
    MaterialRecord materials[];
};
layout(set = 1, binding = 1) uniform sampler3D reflectance_tables;        // reflectance in 1/sr, tables side by side in y and z
layout(set = 1, binding = 2) uniform usampler2D importance_cells;       // cells of equal probability: borders in t and phi, in steps, 16 bits each
layout(set = 1, binding = 3) uniform sampler2D importance_density;      // density of h in 1/sr for weights

// A material as seen from one view direction.
struct Material {
    MaterialRecord record;
    ivec2 cell;      // first texel of its importance cells for this view angle
    vec2 density;    // first texel of its density tile
    vec2 table;      // first texel of its table in y, z
    vec3 turn;       // cosine and sine of the angle from the tangent frame's x axis to the local one; handedness
    vec4 lobes[2];   // the first two vMF lobes: mean direction, concentration; without branches, as most have no more
    vec2 peaks;      // their densities at the centre; the first is a cosine-power's, too
    vec2 lobe;       // concentration and density at the centre of a lobe of weight 1, where a map replaces the lobes' own
    float sharpness; // of lobes, over that of the material's own
    float kernel;    // added to 2 / concentration of the lobes' own
    float area;      // projected area of the lobes so widened
};

bool material_is(uint kind, uint which) {
    return (MATERIAL_KINDS & 1u << which) != 0u && kind == which;
}

bool material_is_table(uint kind) {
    return (MATERIAL_KINDS & ~REFLECTANCE_TABLES) == 0u || material_is(kind, REFLECTANCE_TABLE) || material_is(kind, REFLECTANCE_TURNED);
}

// Concentration and density at the centre of the lobe that a record holds, as maps and filters leave it.
vec2 material_lobe(Material m, uint record) {
    float kappa = materials[record].f0.w;
    vec4 lobe = materials[record].albedo;
    bool own = m.lobe.y == 0.0;
    float peak = own ? lobe.x : lobe.y * m.lobe.y;
    kappa = own ? kappa : m.lobe.x;
    if (MATERIAL_KERNEL) {
        bool widened = m.kernel > 0.0;
        kappa = widened ? kappa / (1.0 + 0.5 * kappa * m.kernel) : kappa;
        peak = widened ? lobe.y * vmf_normalisation(kappa) / m.area : peak;
    }
    return vec2(kappa, peak);
}

Material material_load(uint id, float cos_o, vec3 turn, Factors factors) {
    Material m;
    m.record = materials[id];
    uint kind = m.record.kind.x;
    bool table = material_is_table(kind);
    bool vmf = material_is(kind, REFLECTANCE_VMF);
    vec3 f0 = m.record.f0.rgb * (table ? factors.albedo : factors.specular);
    m.record.f0.rgb = table || vmf ? f0 : min(f0, 1.0);
    m.record.albedo.rgb = min(m.record.albedo.rgb * factors.albedo, 1.0);

    // Alpha squared: a lobe's is 2 / concentration, a cosine's 2 / (exponent + 2).
    bool rough = factors.alpha != NO_ALPHA;
    bool cosine = material_is(kind, REFLECTANCE_BLINN_PHONG);
    float own = m.record.f0.w;
    float square = vmf ? m.record.albedo.w : (cosine ? 2.0 / (own + 2.0) : own * own);
    float before = square;
    square = (rough ? factors.alpha * factors.alpha : square) + factors.kernel;
    bool changed = rough || factors.kernel > 0.0;
    m.sharpness = changed ? sqrt(before / square) : 1.0;
    float narrow = min(square, 1.0);
    m.record.f0.w = changed && !table && !vmf ? (cosine ? 2.0 / narrow - 2.0 : sqrt(narrow)) : own;
    float kappa = 2.0 / square;
    float facing = vmf_mean_cosine(kappa) * own;
    m.lobe = rough ? vec2(kappa, vmf_normalisation(kappa) / max(facing, LEAST_PROJECTED_AREA)) : vec2(0.0);
    m.kernel = 0.0;
    m.area = 1.0;
    if (MATERIAL_KERNEL) {
        m.kernel = rough ? 0.0 : factors.kernel;
        float area = 0.0, weight = 0.0;
        for (uint i = 0u; i < (vmf ? m.record.kind.z : 1u); ++i) {
            MaterialRecord lobe = materials[vmf ? m.record.kind.y + i : 0u];
            area += lobe.albedo.y * vmf_mean_cosine(lobe.f0.w / (1.0 + 0.5 * lobe.f0.w * m.kernel)) * lobe.f0.z;
            weight += lobe.albedo.y;
        }
        m.area = max(area / weight, LEAST_PROJECTED_AREA);
    }

    // Without lobes of its own, a record stands in, unused.
    for (int k = 0; k < 2; ++k) {
        bool there = vmf && m.record.kind.z > uint(k);
        uint record = there ? m.record.kind.y + uint(k) : id;
        vec2 lobe = material_lobe(m, record);
        m.lobes[k] = there ? vec4(materials[record].f0.xyz, lobe.x) : vec4(0.0);
        m.peaks[k] = there ? lobe.y : 0.0;
    }
    m.peaks.x = cosine ? blinn_phong_peak(m.record.f0.w) : m.peaks.x;

    uint angle = min(uint(acos_positive(clamp(cos_o, 0.0, 1.0)) * (2.0 * INV_PI * float(IMPORTANCE_ANGLES))), IMPORTANCE_ANGLES - 1u);
    vec4 steps = m.record.importance;
    float step_number = changed ? round((log2(square) - steps.z) * steps.w) : 0.0;
    uint tile = uint(steps.x + clamp(step_number, 0.0, steps.y));
    uvec2 at = uvec2((tile >> 6) * IMPORTANCE_ANGLES + angle, tile & 63u);
    m.cell = ivec2((tile >> 6) * (IMPORTANCE_COLUMNS * IMPORTANCE_ROWS), (tile & 63u) * IMPORTANCE_ANGLES + angle);
    m.density = vec2(at) * DENSITY_SIZE;
    m.table = vec2(m.record.kind.yz) * TABLE_SIZE.yz;
    m.turn = turn;
    return m;
}

// For surfaces without maps and tangents: the local frame stands for the tangent frame.
Material material_load(uint id, float cos_o) {
    Factors factors = NO_FACTORS;
    factors.albedo = materials[id].kind.x == REFLECTANCE_VMF ? vec3(0.0) : factors.albedo;
    return material_load(id, cos_o, vec3(1.0, 0.0, 1.0), factors);
}

// A table, or tables over the half vector's azimuth (src/reflectance/turned.rs) of which two neighbours are mixed; h is the half
// vector of directions above the horizon, t the same in the tangent frame.
vec3 material_tables(Material m, vec3 wi, vec3 wo, vec3 h, vec3 t) {
    bool turned = material_is(m.record.kind.x, REFLECTANCE_TURNED);
    vec2 size = vec2(textureSize(reflectance_tables, 0).yz);
    vec2 border = max(vec2(TABLE_BORDER), 0.5 + size * (1.0 / 4194304.0));
    vec2 c = vec2(acos_positive(clamp(dot(wo, h), 0.0, 1.0)) * (2.0 * INV_PI), half_warp(h)) * TABLE_SIZE.yz;
    c = clamp(c, border, TABLE_SIZE.yz - border);
    float phi_d = difference_turn(wi, h);

    // In floating point, as the reference driver divides integers one by one: numbers are small enough to be exact.
    float count = float(m.record.kind.z);
    float columns = round(size.x / TABLE_SIZE.y);
    float at = turned ? atan_full(t.y, t.x) * m.record.f0.w : 0.0;
    float node = floor(at);
    float weight = at - node;
    vec2 table = m.table;
    vec3 sum = vec3(0.0);
    for (uint i = 0u; i < 2u; ++i) {
        if (turned) {
            float slot = float(m.record.kind.y) + node - count * floor((node + 0.5) / count);
            float row = floor((slot + 0.5) / columns);
            table = vec2(slot - row * columns, row) * TABLE_SIZE.yz;
        }
        sum += textureLod(reflectance_tables, vec3(phi_d, (c + table) / size), 0.0).rgb * (i == 0u ? 1.0 - weight : weight);
        if (!turned) {
            break;
        }
        node += 1.0;
    }
    return sum * m.record.f0.rgb * m.record.albedo.a;
}

// Density of normals in 1/sr of the two kinds with V-cavity masking: cosine-power (src/reflectance/blinn_phong.rs) and a mixture
// of vMF lobes (src/reflectance/vmf.rs).
float material_distribution(Material m, vec3 h, vec3 t) {
    vec3 d = t - m.lobes[0].xyz, e = t - m.lobes[1].xyz;
    bool cosine = m.record.kind.x == REFLECTANCE_BLINN_PHONG;
    float exponent = cosine ? blinn_phong_exponent(m.record.f0.a, h) : -0.5 * m.lobes[0].w * dot(d, d);
    float sum = m.peaks.x * exp(exponent) + m.peaks.y * exp(-0.5 * m.lobes[1].w * dot(e, e));
    uint count = m.record.kind.x == REFLECTANCE_VMF ? m.record.kind.z : 0u;
    for (uint i = 2u; i < count; ++i) {
        vec3 mu = materials[m.record.kind.y + i].f0.xyz;
        vec2 lobe = material_lobe(m, m.record.kind.y + i);
        vec3 d = t - mu;
        sum += lobe.y * exp(-0.5 * lobe.x * dot(d, d));
    }
    return sum;
}

// BRDF in 1/sr for directions above the horizon, h their half vector. Kinds share what they can and there is no early return:
// the reference driver runs all branches.
vec3 material_evaluate(Material m, vec3 wi, vec3 wo, vec3 h) {
    uint kind = m.record.kind.x;
    vec3 t = vec3(m.turn.x * h.x - m.turn.y * h.y, (m.turn.y * h.x + m.turn.x * h.y) * m.turn.z, h.z);
    vec3 value;
    if (material_is_table(kind)) {
        value = material_tables(m, wi, wo, h, t);
    } else if (material_is(kind, REFLECTANCE_GGX)) {
        value = ggx_evaluate(m.record.f0.rgb, m.record.albedo.rgb, m.record.f0.a, wi, wo, h);
    } else {
        value = m.record.f0.rgb * (material_distribution(m, h, t) * cavity_masking(wi, wo, h)) + m.record.albedo.rgb * INV_PI;
    }
    return value;
}

// Borders t and phi from steps of 16 bits (src/reflectance/importance.rs, `borders`).
vec2 importance_border(uvec2 steps) {
    vec2 share = vec2(ivec2(steps)) * vec2(1.0 / 65535.0, PI / 65535.0);
    share.x *= share.x;
    return vec2(share.x * share.x, share.y);
}

// A half vector, and its density in 1/sr of h, from two 32-bit numbers (Bagher 2011, section 3.3).
vec4 material_sample(Material m, uvec2 u) {
    uint row, row_fraction, column, column_fraction;
    umulExtended(u.x, IMPORTANCE_ROWS, row, row_fraction);
    umulExtended(u.y << 1, IMPORTANCE_COLUMNS, column, column_fraction);
    uvec2 cell = texelFetch(importance_cells, m.cell + ivec2(row * IMPORTANCE_COLUMNS + column, 0), 0).xy;
    vec2 low = importance_border(cell & 0xffffu), size = importance_border(cell >> 16) - low;
    vec2 at = low + size * (vec2(ivec2(row_fraction >> 8, column_fraction >> 8)) * (1.0 / 16777216.0));
    float s = sqrt(at.x * (2.0 - at.x));
    vec2 phi = cos_sin((u.y & 0x80000000u) == 0u ? at.y : -at.y);
    return vec4(s * phi, 1.0 - at.x, 1.0 / (float(2u * IMPORTANCE_ROWS * IMPORTANCE_COLUMNS) * size.x * size.y));
}

// Smooth density of h in 1/sr, for multiple importance weights only: positive, deterministic, close to that of material_sample.
float material_density(Material m, vec3 h) {
    float s = length(h.xy);
    float c = s > 0.0 ? 0.5 - 0.5 * h.x / s : 0.5;
    vec2 at = clamp(vec2(c, half_warp(h)) * DENSITY_SIZE, vec2(0.5), DENSITY_SIZE - 0.5) + m.density;
    return textureLod(importance_density, at / vec2(textureSize(importance_density, 0)), 0.0).x;
}

#endif
