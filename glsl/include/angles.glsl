// Trigonometric functions and their inverses by least-squares polynomials at Chebyshev nodes; absolute error in radians beside each.
// They replace the driver's own, which differ between drivers and cost more on the reference one.
#ifndef ANGLES_GLSL
#define ANGLES_GLSL

const float PI = 3.14159265358979;
const float HALF_PI = 1.57079632679490;
const float INV_PI = 0.31830988618379;

// asin on [0, sqrt(1/2)], 2e-7
float asin_small(float a) {
    float q = a * a;
    float p = fma(q, fma(q, fma(q, fma(q, fma(q, fma(q, 0.1018853, -0.05647404), 0.06174937), 0.03859996), 0.07553816), 0.166649), 1.00000009);
    return a * p;
}

// acos on [0, 1], 2e-7 of the factor before sqrt(1-c)
float acos_positive(float c) {
    float p = fma(c, fma(c, fma(c, fma(c, fma(c, fma(c, 0.00225137, -0.01101239), 0.02674933), -0.0487244), 0.08873733), -0.2145837), 1.57079615);
    return sqrt(max(1.0 - c, 0.0)) * p;
}

// acos on [-1, 1]
float acos_full(float c) {
    float a = acos_positive(min(abs(c), 1.0));
    return c < 0.0 ? PI - a : a;
}

// atan of the ratio of two non-negative numbers, in [0, pi/2]; 0 for (0, 0); 2e-7
float atan_quadrant(float y, float x) {
    float big = max(x, y);
    float r = big > 0.0 ? min(x, y) / big : 0.0;
    float q = r * r;
    float p = fma(q, fma(q, fma(q, fma(q, fma(q, fma(q, fma(q, -0.00466877, 0.02416619), -0.0593671), 0.09906097), -0.14016585), 0.19969235), -0.3333196), 0.9999999);
    float a = r * p;
    return y > x ? HALF_PI - a : a;
}

// atan2 in [-pi, pi]
float atan_full(float y, float x) {
    float a = atan_quadrant(abs(y), abs(x));
    a = x < 0.0 ? PI - a : a;
    return y < 0.0 ? -a : a;
}

// atan2 modulo pi, in [-pi/2, pi/2]
float atan_line(float y, float x) {
    float a = atan_quadrant(abs(y), abs(x));
    return (x < 0.0) != (y < 0.0) ? -a : a;
}

// (cos x, sin x) for x in [-pi, pi], 5e-8
vec2 cos_sin(float x) {
    float a = abs(x);
    bool far = a > HALF_PI;
    float y = far ? PI - a : a;
    float q = y * y;
    float s = y * fma(q, fma(q, fma(q, fma(q, 2.60516628e-06, -0.000198090464), 0.00833305062), -0.16666658), 0.999999996);
    float c = fma(q, fma(q, fma(q, fma(q, 2.31531742e-05, -0.00138536669), 0.0416635789), -0.499999051), 0.999999953);
    return vec2(far ? -c : c, x < 0.0 ? -s : s);
}

#endif
