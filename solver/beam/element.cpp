#include "solver/beam/element.hpp"

#include "solver/beam/rotation.hpp"
#include "solver/beam/table_law.hpp"

#include <Eigen/Geometry>
#include <cmath>

// Kinematics. With q1, q2 the nodes' rotations, e = x2 - x1, (w, p) = q1* q2 and y = R1^T e,
// the strains of the pose logarithm are (v = chord in the mid frame, phi = half angle / sine)
//
//     L Gamma = phi w y - phi p x y + psi (p.y) p,      L kappa = 2 phi p,
//     phi(w) = acos(w) / sqrt(1 - w^2),                 psi = -phi'(w),
//
// polynomials in (y, w, p) but for phi(w). The energy's derivatives are formed in these seven
// variables and then mapped to nodal displacements by
//
//     dy = R1^T de + y x theta1,   dw = p.(theta1 - theta2)/2,
//     dp = -(w theta1 + theta1 x p)/2 + (w theta2 + p x theta2)/2
//
// with the second-order terms of the two exponentials. Derivation: docs/theory/beams.md.
//
// The kernel is a template: with T = Lanes it does four elements at once.

namespace amontons {
namespace {

typedef double Lanes __attribute__((vector_size(32)));

template <class T> struct V {
    T x, y, z;
};
template <class T> V<T> operator+(V<T> a, V<T> b)
{
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T> V<T> operator-(V<T> a, V<T> b)
{
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T> V<T> operator*(T s, V<T> a)
{
    return {s * a.x, s * a.y, s * a.z};
}
template <class T> T dot(V<T> a, V<T> b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T> V<T> cross(V<T> a, V<T> b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// 3x3 by columns.
template <class T> struct M {
    V<T> c[3];
};
template <class T> M<T> operator+(M<T> a, M<T> b)
{
    return {{a.c[0] + b.c[0], a.c[1] + b.c[1], a.c[2] + b.c[2]}};
}
template <class T> M<T> operator-(M<T> a, M<T> b)
{
    return {{a.c[0] - b.c[0], a.c[1] - b.c[1], a.c[2] - b.c[2]}};
}
template <class T> M<T> operator*(T s, M<T> a)
{
    return {{s * a.c[0], s * a.c[1], s * a.c[2]}};
}
inline V<Lanes> operator*(double s, V<Lanes> a)
{
    return {s * a.x, s * a.y, s * a.z};
}
inline M<Lanes> operator*(double s, M<Lanes> a)
{
    return {{s * a.c[0], s * a.c[1], s * a.c[2]}};
}
template <class T> V<T> operator*(M<T> a, V<T> b)
{
    return b.x * a.c[0] + b.y * a.c[1] + b.z * a.c[2];
}
template <class T> M<T> operator*(M<T> a, M<T> b)
{
    return {{a * b.c[0], a * b.c[1], a * b.c[2]}};
}
template <class T> M<T> transpose(M<T> a)
{
    return {{{a.c[0].x, a.c[1].x, a.c[2].x},
             {a.c[0].y, a.c[1].y, a.c[2].y},
             {a.c[0].z, a.c[1].z, a.c[2].z}}};
}
/// a^T b
template <class T> M<T> transpose_times(M<T> a, M<T> b)
{
    return transpose(a) * b;
}
template <class T> V<T> transpose_times(M<T> a, V<T> b)
{
    return {dot(a.c[0], b), dot(a.c[1], b), dot(a.c[2], b)};
}
template <class T> M<T> outer(V<T> a, V<T> b)
{
    return {{b.x * a, b.y * a, b.z * a}};
}
template <class T> M<T> skew(V<T> a)
{
    const T o = a.x - a.x;
    return {{{o, a.z, -a.y}, {-a.z, o, a.x}, {a.y, -a.x, o}}};
}
template <class T> M<T> plus_diagonal(M<T> a, T s)
{
    a.c[0].x += s;
    a.c[1].y += s;
    a.c[2].z += s;
    return a;
}
/// diag(d) a
template <class T> M<T> scale_rows(V<T> d, M<T> a)
{
    for (int j = 0; j < 3; ++j)
        a.c[j] = {d.x * a.c[j].x, d.y * a.c[j].y, d.z * a.c[j].z};
    return a;
}
template <class T> V<T> scale_rows(V<T> d, V<T> a)
{
    return {d.x * a.x, d.y * a.y, d.z * a.z};
}

template <class T> struct Phi {
    T f, f1, f2, f3;
};

// phi = sum c_k (1-w)^k with c_k = c_{k-1} k/(2k+1); only phi''' is summed, the others follow
// from (1 - w^2) phi' = w phi - 1 and its derivatives, without cancellation.
constexpr int kTerms = 26;
constexpr std::array<double, kTerms> third_derivative_series()
{
    std::array<double, kTerms> s{};
    double c = 1;
    for (int k = 1; k < kTerms + 3; ++k) {
        c *= double(k) / (2 * k + 1);
        if (k >= 3) s[std::size_t(k - 3)] = -c * k * (k - 1) * (k - 2);
    }
    return s;
}
constexpr std::array<double, kTerms> kSeries = third_derivative_series();

template <class T> Phi<T> half_angle_over_sine(T w)
{
    const T y = 1.0 - w;
    T f3 = w - w + kSeries[kTerms - 1];
    for (int k = kTerms - 2; k >= 0; --k)
        f3 = f3 * y + kSeries[std::size_t(k)];
    const T s = y * (1.0 + w); // 1 - w^2
    const T w2 = w * w;
    const T d = 1.0 + 2.0 * w2;
    const T f2 = (d * s * f3 + 4.0) / (w * (9.0 + 6.0 * w2));
    const T f1 = (w * s * f2 - 1.0) / d;
    const T f = s * f2 - 3.0 * w * f1;
    return {f, f1, f2, f3};
}

template <class T> struct Pose {
    M<T> R1;
    V<T> y, p;
    T w;
};

template <class T> T flip_sign_if_negative(T sign_of, T value);
template <> double flip_sign_if_negative(double sign_of, double value)
{
    return sign_of < 0 ? -value : value;
}
template <> Lanes flip_sign_if_negative(Lanes sign_of, Lanes value)
{
    return sign_of < 0 ? -value : value;
}

template <class T> Pose<T> relative_pose(V<T> e, T w1, V<T> v1, T w2, V<T> v2)
{
    const T raw = w1 * w2 + dot(v1, v2);
    const V<T> p = w1 * v2 - w2 * v1 - cross(v1, v2);
    Pose<T> r;
    r.w = flip_sign_if_negative(raw, raw);
    r.p = {flip_sign_if_negative(raw, p.x), flip_sign_if_negative(raw, p.y),
           flip_sign_if_negative(raw, p.z)};
    const T xx = v1.x * v1.x, yy = v1.y * v1.y, zz = v1.z * v1.z;
    const T xy = v1.x * v1.y, xz = v1.x * v1.z, yz = v1.y * v1.z;
    const T wx = w1 * v1.x, wy = w1 * v1.y, wz = w1 * v1.z;
    r.R1 = {{{1.0 - 2.0 * (yy + zz), 2.0 * (xy + wz), 2.0 * (xz - wy)},
             {2.0 * (xy - wz), 1.0 - 2.0 * (xx + zz), 2.0 * (yz + wx)},
             {2.0 * (xz + wy), 2.0 * (yz - wx), 1.0 - 2.0 * (xx + yy)}}};
    r.y = transpose_times(r.R1, e);
    return r;
}

template <class T> struct BeamStrain {
    V<T> gamma, kappa;
};
template <class T> BeamStrain<T> strain(const Pose<T>& s, const Phi<T>& f, T inverse_length)
{
    const V<T> g = (s.w * f.f) * s.y - f.f * cross(s.p, s.y) - (f.f1 * dot(s.p, s.y)) * s.p;
    return {inverse_length * g, (2.0 * f.f * inverse_length) * s.p};
}

/// Derivatives of a.(L Gamma) + b.(L kappa) in (y, w, p).
template <class T> struct Gradient7 {
    V<T> y, p;
    T w;
};
template <class T> Gradient7<T> gradient(const Pose<T>& s, const Phi<T>& f, V<T> a, V<T> b)
{
    const T psi = -f.f1, psi1 = -f.f2;
    const T tau = dot(s.p, s.y), mu = dot(a, s.y), gamma = dot(a, s.p);
    const V<T> ya = cross(s.y, a);
    const T nu = dot(s.p, ya);
    Gradient7<T> g;
    g.y = (s.w * f.f) * a - f.f * cross(a, s.p) + (psi * gamma) * s.p;
    g.w = (f.f + s.w * f.f1) * mu - f.f1 * nu + psi1 * tau * gamma + 2.0 * f.f1 * dot(b, s.p);
    g.p = psi * (gamma * s.y + tau * a) - f.f * ya + (2.0 * f.f) * b;
    return g;
}

/// Gradient in (R1^T de, theta1, theta2).
template <class T> struct Gradient9 {
    V<T> e, t1, t2;
};
template <class T> Gradient9<T> to_rotations(const Pose<T>& s, const Gradient7<T>& g)
{
    const V<T> pc = 0.5 * cross(s.p, g.p), pw = (0.5 * g.w) * s.p, wc = (0.5 * s.w) * g.p;
    return {g.y, pw - wc - pc - cross(s.y, g.y), wc - pw - pc};
}

template <class T> struct Tangent {
    V<T> f, g1, g2;                 // forces: on x2 (space), theta1, theta2
    M<T> ee, e1, e2, k11, k12, k22; // blocks; e in space
};

/// @param S23   couples the two curvatures in the tangent alone; the stress is S e - P
/// @param bow   bowing, times the shears what the stretch changes by with them
/// @param more  what the geometric part's strains are beyond the pose's
template <class T>
Tangent<T> tangent(const Pose<T>& s, T length, const T S[6], const T P[6], T S23, const T bow[2],
                   const T more[6])
{
    const Phi<T> f = half_angle_over_sine(s.w);
    const T il = 1.0 / length;
    const BeamStrain<T> strains = strain(s, f, il);
    const V<T> C2{S[3], S[4], S[5]};

    // ---- Stress and its derivatives by the strains
    // Of the mean stretch g.x + 1/2 (bow_0 g.y^2 + bow_1 g.z^2): its derivatives are 1, by, bz.
    const V<T> g_own = strains.gamma;
    const T by = bow[0] * g_own.y, bz = bow[1] * g_own.z;
    // Its parts apart: that of first order cancels against P, and is known to the round-off of 1.
    const T own_n = (S[0] * g_own.x - P[0]) + 0.5 * S[0] * (by * g_own.y + bz * g_own.z);
    const T n = own_n + S[0] * (more[0] + by * more[1] + bz * more[2]);
    const V<T> own_a =
        il * V<T>{own_n, S[1] * g_own.y - P[1] + own_n * by, S[2] * g_own.z - P[2] + own_n * bz};
    const V<T> own_b = il * (scale_rows(C2, strains.kappa) - V<T>{P[3], P[4], P[5]});
    const V<T> a = il * V<T>{n, S[1] * (g_own.y + more[1]) - P[1] + n * by,
                             S[2] * (g_own.z + more[2]) - P[2] + n * bz};
    const V<T> b = own_b + il * scale_rows(C2, V<T>{more[3], more[4], more[5]});
    const V<T> C1{S[0], S[1] + n * bow[0], S[2] + n * bow[1]};
    const V<T> y = s.y, p = s.p;

    // ---- Second derivatives in (y, w, p)
    const T w = s.w;
    const T psi = -f.f1, psi1 = -f.f2, psi2 = -f.f3;
    const T tau = dot(p, y), mu = dot(a, y), gamma = dot(a, p);
    const V<T> ya = cross(y, a), ap = cross(a, p);
    const T nu = dot(p, ya), delta = dot(b, p);
    const T a1 = w * f.f, a11 = f.f + w * f.f1, a12 = 2.0 * f.f1 + w * f.f2;
    const Gradient7<T> g = gradient(s, f, a, b);

    // strain gradients in (y, w, p), divided by L
    M<T> Gy = plus_diagonal((il * psi) * outer(p, p) - (il * f.f) * skew(p), il * a1);
    V<T> Gw = il * (a11 * y - f.f1 * cross(p, y) + (psi1 * tau) * p);
    M<T> Gp = plus_diagonal((il * f.f) * skew(y) + (il * psi) * outer(p, y), il * psi * tau);
    for (int j = 0; j < 3; ++j) { // the first row that of the mean stretch
        Gy.c[j].x = Gy.c[j].x + by * Gy.c[j].y + bz * Gy.c[j].z;
        Gp.c[j].x = Gp.c[j].x + by * Gp.c[j].y + bz * Gp.c[j].z;
    }
    Gw.x = Gw.x + by * Gw.y + bz * Gw.z;
    const V<T> kw = (2.0 * il * f.f1) * p;
    const T kp = 2.0 * il * f.f;

    const M<T> CGy = scale_rows(C1, Gy), CGp = scale_rows(C1, Gp);
    const V<T> CGw = scale_rows(C1, Gw),
               Ckw = scale_rows(C2, kw) + S23 * V<T>{kw.x - kw.x, kw.z, kw.y};
    const M<T> Kyy = transpose_times(Gy, CGy);
    const V<T> Kyw = transpose_times(Gy, CGw) + a11 * a - f.f1 * ap + (psi1 * gamma) * p;
    const M<T> Kyp =
        plus_diagonal(transpose_times(Gy, CGp) - f.f * skew(a) + psi * outer(p, a), psi * gamma);
    const T Kww = dot(Gw, CGw) + dot(kw, Ckw) + a12 * mu - f.f2 * nu + psi2 * tau * gamma +
                  2.0 * f.f2 * delta;
    const V<T> Kwp = transpose_times(Gp, CGw) + kp * Ckw - f.f1 * ya +
                     psi1 * (gamma * y + tau * a) + (2.0 * f.f1) * b;
    M<T> Kpp = transpose_times(Gp, CGp) + psi * (outer(y, a) + outer(a, y));
    const T kp2 = kp * kp;
    Kpp.c[0].x += kp2 * C2.x;
    Kpp.c[1].y += kp2 * C2.y;
    Kpp.c[2].z += kp2 * C2.z;
    Kpp.c[1].z += kp2 * S23;
    Kpp.c[2].y += kp2 * S23;

    // ---- Mapping to the nodes
    // to (e, theta1, theta2): half = w/2, half skew(p) the derivatives of p
    const M<T> hp = 0.5 * skew(p);
    const T h = 0.5 * w;
    const V<T> p2 = 0.5 * p;
    const M<T> O = outer(Kyw, p2), A = h * Kyp, B = Kyp * hp;
    const M<T> X1 = O - A + B, X2 = A - O + B;
    const M<T> Op = outer(Kwp, p2), Ap = h * Kpp, Bp = Kpp * hp;
    const M<T> Zp1 = Op - Ap + Bp, Zp2 = Ap - Op + Bp;
    const V<T> Bw = transpose_times(hp, Kwp); // (Kwp^T hp)^T
    const V<T> Zw1 = Kww * p2 - h * Kwp + Bw, Zw2 = h * Kwp - Kww * p2 + Bw;
    const M<T> Y = skew(y);
    const M<T> KyyY = Kyy * Y;

    Tangent<T> t;
    const V<T> z = g.y, c = g.p;
    const M<T> E1 = KyyY + X1 - skew(z), E2 = X2;
    const T r = -0.25 * (w * g.w + dot(c, p));
    const M<T> YX1 = transpose_times(Y, X1);
    t.k11 = plus_diagonal(outer(p2, Zw1) - h * Zp1 - hp * Zp1 + transpose_times(Y, KyyY) + YX1 +
                              transpose(YX1) + 0.5 * (outer(y, z) + outer(z, y)),
                          r - dot(y, z));
    t.k12 = plus_diagonal(outer(p2, Zw2) - h * Zp2 - hp * Zp2 + transpose_times(Y, X2) +
                              0.25 * (outer(p, c) + outer(c, p) + skew(g.w * p + w * c)),
                          0.25 * (w * g.w - dot(c, p)));
    t.k22 = plus_diagonal(h * Zp2 - hp * Zp2 - outer(p2, Zw2), r);
    t.ee = s.R1 * (Kyy * transpose(s.R1));
    t.e1 = s.R1 * E1;
    t.e2 = s.R1 * E2;
    const Gradient9<T> g9 = to_rotations(s, gradient(s, f, own_a, own_b));
    t.f = s.R1 * g9.e;
    t.g1 = g9.t1;
    t.g2 = g9.t2;
    return t;
}

Pose<double> pose_of(const BeamNode& a, const BeamNode& b)
{
    return relative_pose<double>({b.difference(a, 0), b.difference(a, 1), b.difference(a, 2)},
                                 a.q[0], {a.q[1], a.q[2], a.q[3]}, b.q[0],
                                 {b.q[1], b.q[2], b.q[3]});
}

/// The strains, the first of them the mean stretch.
std::array<double, 6> with_mean_stretch(const ElementLaw& law, std::array<double, 6> strain)
{
    strain[0] = mean_stretch(law, strain);
    return strain;
}

/// @param strain  with the mean stretch
std::array<double, 6> without_natural(const ElementLaw& law, const std::array<double, 6>& strain)
{
    std::array<double, 6> e{};
    for (std::size_t i = 0; i < 6; ++i)
        e[i] = strain[i] - (law.S[i] > 0 ? law.P[i] / law.S[i] : 0);
    return e;
}

/// The linear law that has the stress and the tangent of an element's at its strains.
struct LinearLaw {
    double length;
    std::array<double, 6> S, P;
    double S23 = 0;
};

LinearLaw law_at(const ElementLaw& law, const BeamNode& a, const BeamNode& b)
{
    LinearLaw at{law.length, law.S, law.P};
    if (law.beyond.empty()) return at;
    const std::array<double, 6> e = with_mean_stretch(law, element_strain(a, b, law.length));
    const BeyondLinear more = beyond_linear(law.beyond, without_natural(law, e));
    at.S[0] += more.stretch;
    at.S[4] += more.bend22;
    at.S[5] += more.bend33;
    at.S23 = more.bend23;
    for (std::size_t i : {0, 4, 5})
        at.P[i] += (at.S[i] - law.S[i]) * e[i] - more.stress[i];
    return at;
}

double lane(double v, int)
{
    return v;
}
double lane(Lanes v, int i)
{
    return v[i];
}

/// Adds lane i of t to the blocks of element k.
template <class T>
void scatter(const Tangent<T>& t, int i, int k, BlockTridiagonal& K, std::vector<Node6>& g)
{
    Block6& d1 = K.diagonal(k);
    Block6& d2 = K.diagonal(k + 1);
    Block6& up = K.upper(k);
    Block6& lo = K.lower(k);
    const auto entry = [i](const M<T>& m, int row, int col) {
        const V<T>& c = m.c[col];
        return lane(row == 0 ? c.x : row == 1 ? c.y : c.z, i);
    };
#pragma GCC unroll 3
    for (int col = 0; col < 3; ++col) {
#pragma GCC unroll 3
        for (int row = 0; row < 3; ++row) {
            const double ee = entry(t.ee, row, col);
            const double e1 = entry(t.e1, row, col), e2 = entry(t.e2, row, col);
            const double k12 = entry(t.k12, row, col);
            d1(row, col) += ee;
            d2(row, col) += ee;
            up(row, col) -= ee;
            lo(row, col) -= ee;
            d1(row, col + 3) -= e1;
            d1(col + 3, row) -= e1;
            lo(row, col + 3) += e1;
            up(col + 3, row) += e1;
            d2(row, col + 3) += e2;
            d2(col + 3, row) += e2;
            up(row, col + 3) -= e2;
            lo(col + 3, row) -= e2;
            d1(row + 3, col + 3) += entry(t.k11, row, col);
            d2(row + 3, col + 3) += entry(t.k22, row, col);
            up(row + 3, col + 3) += k12;
            lo(col + 3, row + 3) += k12;
        }
    }
    double* g1 = g[std::size_t(k)].value;
    double* g2 = g[std::size_t(k) + 1].value;
    const V<T>* parts[3] = {&t.f, &t.g1, &t.g2};
    for (int part = 0; part < 3; ++part) {
        const double v[3] = {lane(parts[part]->x, i), lane(parts[part]->y, i),
                             lane(parts[part]->z, i)};
        for (int r = 0; r < 3; ++r) {
            if (part == 0) {
                g1[r] -= v[r];
                g2[r] += v[r];
            } else if (part == 1) {
                g1[r + 3] += v[r];
            } else {
                g2[r + 3] += v[r];
            }
        }
    }
}

} // namespace

std::array<double, 6> element_strain(const BeamNode& a, const BeamNode& b, double length)
{
    const Pose<double> s = pose_of(a, b);
    const BeamStrain<double> e = strain(s, half_angle_over_sine(s.w), 1 / length);
    return {e.gamma.x, e.gamma.y, e.gamma.z, e.kappa.x, e.kappa.y, e.kappa.z};
}

std::array<double, 6> predicted_strain(const BeamNode& a, const BeamNode& b, double length,
                                       const double* da, const double* db)
{
    const Pose<double> s = pose_of(a, b);
    const Phi<double> f = half_angle_over_sine(s.w);
    const V<double> de{db[0] - da[0], db[1] - da[1], db[2] - da[2]};
    const V<double> t1{da[3], da[4], da[5]}, t2{db[3], db[4], db[5]};
    const V<double> dy = transpose_times(s.R1, de) + cross(s.y, t1);
    const double dw = 0.5 * dot(s.p, t1 - t2);
    const V<double> dp = 0.5 * (s.w * (t2 - t1) + cross(s.p, t1 + t2));
    const double tau = dot(s.p, s.y), dtau = dot(dp, s.y) + dot(s.p, dy);
    const BeamStrain<double> e = strain(s, f, 1 / length);
    const V<double> dg = ((f.f + s.w * f.f1) * dw) * s.y + (s.w * f.f) * dy -
                         (f.f1 * dw) * cross(s.p, s.y) - f.f * (cross(dp, s.y) + cross(s.p, dy)) -
                         (f.f2 * dw * tau + f.f1 * dtau) * s.p - (f.f1 * tau) * dp;
    const V<double> gamma = e.gamma + (1 / length) * dg;
    const V<double> kappa = e.kappa + (2 / length) * ((f.f1 * dw) * s.p + f.f * dp);
    return {gamma.x, gamma.y, gamma.z, kappa.x, kappa.y, kappa.z};
}

std::array<double, 6> natural_strain(const ElementLaw& law)
{
    std::array<double, 6> k{1};
    for (std::size_t i = 0; i < 6; ++i)
        if (law.S[i] > 0) k[i] = law.P[i] / law.S[i];
    k[0] -= mean_stretch(law, {0, k[1], k[2]}); // what the S-shape is longer than its chord by
    return k;
}

void move_along(BeamNode& node, const std::array<double, 6>& strain, double length)
{
    const Vec3 way = length * Vec3(strain[0], strain[1], strain[2]),
               turn = length * Vec3(strain[3], strain[4], strain[5]);
    const double angle = turn.norm(), square = angle * angle;
    const double half = std::sin(0.5 * angle);
    const double s = angle > 1e-4 ? 2 * half * half / square : 0.5 - square / 24;
    const double c =
        angle > 1e-2 ? (angle - std::sin(angle)) / (square * angle) : 1.0 / 6 - square / 120;
    const Vec3 across = turn.cross(way);
    const Vec3 step = rotation_matrix(node.q) * (way + s * across + c * turn.cross(across));
    for (int j = 0; j < 3; ++j)
        node.move(j, step[j]);
    rotate_in_body(node.q, turn);
}

BeyondLinear beyond_linear(const std::vector<TableShare>& shares,
                           const std::array<double, 6>& strain)
{
    BeyondLinear sum;
    const double k = std::hypot(strain[4], strain[5]);
    for (const TableShare& s : shares) {
        if (s.stretching) {
            const TableLaw::Value v = s.stretching->beyond(strain[0]);
            sum.energy += s.length * v.energy;
            sum.stress[0] += s.length * v.force;
            sum.stretch += s.length * v.stiffness;
        }
        if (!s.bending || !(k > 0)) continue;
        const TableLaw::Value v = s.bending->beyond(k);
        const double n2 = strain[4] / k, n3 = strain[5] / k, across = v.force / k;
        sum.energy += s.length * v.energy;
        sum.stress[4] += s.length * v.force * n2;
        sum.stress[5] += s.length * v.force * n3;
        sum.bend22 += s.length * (v.stiffness * n2 * n2 + across * n3 * n3);
        sum.bend23 += s.length * (v.stiffness - across) * n2 * n3;
        sum.bend33 += s.length * (v.stiffness * n3 * n3 + across * n2 * n2);
    }
    return sum;
}

void set_bowing(ElementLaw& law)
{
    for (const auto& [shear, bend] : {std::pair{1u, 5u}, {2u, 4u}}) {
        if (!(law.S[bend] > 0)) continue;
        const double r = law.S[shear] * law.length * law.length / (12 * law.S[bend]);
        law.bowing[shear - 1] = r * (2 - 0.8 * r);
    }
}

std::array<double, 2> bowing_growth(const ElementLaw& law, const std::array<double, 6>& dS)
{
    std::array<double, 2> d{};
    for (const auto& [shear, bend] : {std::pair{1u, 5u}, {2u, 4u}}) {
        if (!(law.S[bend] > 0)) continue;
        const double r = law.S[shear] * law.length * law.length / (12 * law.S[bend]);
        const double dr = r * (dS[shear] / law.S[shear] + 2 / law.length - dS[bend] / law.S[bend]);
        d[shear - 1] = (2 - 1.6 * r) * dr;
    }
    return d;
}

double mean_stretch(const ElementLaw& law, const std::array<double, 6>& e)
{
    return e[0] + 0.5 * (law.bowing[0] * e[1] * e[1] + law.bowing[1] * e[2] * e[2]);
}

std::array<double, 6> element_stress(const ElementLaw& law, const std::array<double, 6>& strain)
{
    std::array<double, 6> stress{};
    if (!law.beyond.empty())
        stress =
            beyond_linear(law.beyond, without_natural(law, with_mean_stretch(law, strain))).stress;
    for (std::size_t i = 0; i < 6; ++i)
        stress[i] += law.S[i] * strain[i] - law.P[i];
    stress[0] +=
        law.S[0] *
        (0.5 * (law.bowing[0] * strain[1] * strain[1] + law.bowing[1] * strain[2] * strain[2]));
    for (std::size_t i : {1, 2})
        stress[i] += stress[0] * law.bowing[i - 1] * strain[i];
    return stress;
}

double element_energy(const BeamNode& a, const BeamNode& b, const ElementLaw& law)
{
    const std::array<double, 6> e = with_mean_stretch(law, element_strain(a, b, law.length));
    double sum = law.constant;
    for (std::size_t i = 0; i < 6; ++i)
        sum += 0.5 * (law.S[i] * e[i] - 2 * law.P[i]) * e[i];
    if (!law.beyond.empty()) sum += beyond_linear(law.beyond, without_natural(law, e)).energy;
    return sum;
}

std::array<double, 12> element_force(const BeamNode& a, const BeamNode& b, double length,
                                     const std::array<double, 6>& stress)
{
    const Pose<double> s = pose_of(a, b);
    const double il = 1 / length;
    const Gradient9<double> g =
        to_rotations(s, gradient<double>(s, half_angle_over_sine(s.w),
                                         {il * stress[0], il * stress[1], il * stress[2]},
                                         {il * stress[3], il * stress[4], il * stress[5]}));
    const V<double> f = s.R1 * g.e;
    return {-f.x, -f.y, -f.z, g.t1.x, g.t1.y, g.t1.z, f.x, f.y, f.z, g.t2.x, g.t2.y, g.t2.z};
}

void add_elements(int first, int last, const std::vector<BeamNode>& nodes,
                  const std::vector<ElementLaw>& laws, BlockTridiagonal& K, std::vector<Node6>& g,
                  const std::vector<std::array<double, 6>>* predicted)
{
    constexpr int kWidth = 4;
    int k = first;
    const auto beyond_own = [&](std::size_t n) {
        std::array<double, 6> more{};
        if (!predicted) return more;
        const std::array<double, 6> own = element_strain(nodes[n], nodes[n + 1], laws[n].length);
        for (std::size_t j = 0; j < 6; ++j)
            more[j] = (*predicted)[n][j] - own[j];
        return more;
    };
    for (; k + kWidth <= last; k += kWidth) {
        double v[33][kWidth];
        for (int i = 0; i < kWidth; ++i) {
            const std::size_t n = std::size_t(k + i);
            const BeamNode &a = nodes[n], &b = nodes[n + 1];
            const LinearLaw law = law_at(laws[n], a, b);
            for (int j = 0; j < 3; ++j)
                v[j][i] = b.difference(a, j);
            for (int j = 0; j < 4; ++j)
                v[3 + j][i] = a.q[j];
            for (int j = 0; j < 4; ++j)
                v[7 + j][i] = b.q[j];
            v[11][i] = law.length;
            for (std::size_t j = 0; j < 6; ++j)
                v[12 + j][i] = law.S[j];
            for (std::size_t j = 0; j < 6; ++j)
                v[18 + j][i] = law.P[j];
            v[24][i] = law.S23;
            const std::array<double, 6> more = beyond_own(n);
            for (std::size_t j = 0; j < 6; ++j)
                v[25 + j][i] = more[j];
            for (std::size_t j = 0; j < 2; ++j)
                v[31 + j][i] = laws[n].bowing[j];
        }
        const auto in = [&](int j) { return Lanes{v[j][0], v[j][1], v[j][2], v[j][3]}; };
        const Pose<Lanes> s = relative_pose<Lanes>(
            {in(0), in(1), in(2)}, in(3), {in(4), in(5), in(6)}, in(7), {in(8), in(9), in(10)});
        const Lanes S[6] = {in(12), in(13), in(14), in(15), in(16), in(17)};
        const Lanes P[6] = {in(18), in(19), in(20), in(21), in(22), in(23)};
        const Lanes more[6] = {in(25), in(26), in(27), in(28), in(29), in(30)};
        const Lanes bow[2] = {in(31), in(32)};
        const Tangent<Lanes> t = tangent(s, in(11), S, P, in(24), bow, more);
        for (int i = 0; i < kWidth; ++i)
            scatter(t, i, k + i, K, g);
    }
    for (; k < last; ++k) {
        const std::size_t n = std::size_t(k);
        const LinearLaw law = law_at(laws[n], nodes[n], nodes[n + 1]);
        const Tangent<double> t =
            tangent<double>(pose_of(nodes[n], nodes[n + 1]), law.length, law.S.data(), law.P.data(),
                            law.S23, laws[n].bowing.data(), beyond_own(n).data());
        scatter(t, 0, k, K, g);
    }
}

} // namespace amontons
