// Values of roughness maps.
#ifndef ROUGHNESS_GLSL
#define ROUGHNESS_GLSL

// How a roughness map's value v becomes alpha, in the order of src/pass/maps.rs. A lobe's concentration is 2 / alpha^2, a
// cosine's exponent 2 / alpha^2 - 2.
const float RULE_KAPPA = 1.0;    // sqrt(2 / v)
const float RULE_EXPONENT = 2.0; // sqrt(2 / (v + 2))
const float LEAST_ALPHA = 1e-3;

float alpha_by_rule(float rule, float v, float most) {
    v = max(v, 0.0);
    float alpha = rule == RULE_KAPPA ? sqrt(2.0 / v) : (rule == RULE_EXPONENT ? sqrt(2.0 / (v + 2.0)) : v);
    return clamp(alpha, LEAST_ALPHA, most);
}

#endif
