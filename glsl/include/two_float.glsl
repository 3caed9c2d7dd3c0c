// Error-free addition (Knuth's TwoSum, Dekker's Fast2Sum). `precise` forbids the compiler to reassociate,
// without which the error term would be simplified to zero. Works per component.

// Adds `b` to the unevaluated sum hi + lo; afterwards hi is the rounded total.
void two_float_add(inout vec4 hi, inout vec4 lo, vec4 b) {
    precise vec4 s = hi + b;
    precise vec4 v = s - hi;
    precise vec4 e = (hi - (s - v)) + (b - v);
    precise vec4 t = e + lo;
    precise vec4 h = s + t;
    precise vec4 l = t - (h - s);
    hi = h;
    lo = l;
}

void two_float_add(inout float hi, inout float lo, float b) {
    precise float s = hi + b;
    precise float v = s - hi;
    precise float e = (hi - (s - v)) + (b - v);
    precise float t = e + lo;
    precise float h = s + t;
    precise float l = t - (h - s);
    hi = h;
    lo = l;
}

// sum - a b without the rounding of the product (Dekker's product with Veltkamp's splitting).
float product_error(float sum, float a, float b) {
    precise float ca = a * 4097.0;
    precise float a_hi = ca - (ca - a);
    precise float a_lo = a - a_hi;
    precise float cb = b * 4097.0;
    precise float b_hi = cb - (cb - b);
    precise float b_lo = b - b_hi;
    precise float p = a * b;
    precise float e = ((a_hi * b_hi - p) + a_hi * b_lo + a_lo * b_hi) + a_lo * b_lo;
    // p is within a rounding of the sum, so the difference is exact.
    precise float left = (sum - p) - e;
    return left;
}
