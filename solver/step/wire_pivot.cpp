#include "solver/step/wire_pivot.hpp"

#include "solver/step/soft_pivot.hpp"

namespace amontons {
namespace {

double dot(const Node6& a, const Node6& b)
{
    double s = 0;
    for (int i = 0; i < 6; ++i)
        s += a.value[i] * b.value[i];
    return s;
}

/// One wire and its walls: rows on the two nodes of an element, a block-tridiagonal matrix.
struct ChainSystem {
    using Row = ContactRow;
    const Wire& wire;
    NewtonWorkspace& w;

    static double apply(const ContactRow& row, const std::vector<Node6>& d, int e)
    {
        return dot(row.a, d[std::size_t(e)]) + dot(row.b, d[std::size_t(e) + 1]);
    }

    /// K += s f h^T on the two nodes of element e, but only in rows and columns of nodes >= from.
    static void add_product(BlockTridiagonal& K, int e, const ContactRow& f, const ContactRow& h,
                            double s, int from)
    {
        const Column6 fa = f.a.column * splat6(s), fb = f.b.column * splat6(s);
        Block6& d2 = K.diagonal(e + 1);
        for (int j = 0; j < 6; ++j)
            d2.column[j] += fb * splat6(h.b.value[j]);
        if (e < from) return;
        Block6 &d1 = K.diagonal(e), &up = K.upper(e), &lo = K.lower(e);
        for (int j = 0; j < 6; ++j) {
            const Column6 ha = splat6(h.a.value[j]);
            d1.column[j] += fa * ha;
            lo.column[j] += fb * ha;
            up.column[j] += fa * splat6(h.b.value[j]);
        }
    }

    static void add_force(std::vector<Node6>& r, int e, const ContactRow& h, double s)
    {
        r[std::size_t(e)].column += h.a.column * splat6(s);
        r[std::size_t(e) + 1].column += h.b.column * splat6(s);
    }

    static ContactRow combine(const ContactRow& a, double s, const ContactRow& b, double t,
                              const ContactRow& c)
    {
        ContactRow r;
        r.a.column = a.a.column + splat6(s) * b.a.column + splat6(t) * c.a.column;
        r.b.column = a.b.column + splat6(s) * b.b.column + splat6(t) * c.b.column;
        return r;
    }

    static ContactRow combine(double s, const ContactRow& b, double t, const ContactRow& c)
    {
        ContactRow r;
        r.a.column = splat6(s) * b.a.column + splat6(t) * c.a.column;
        r.b.column = splat6(s) * b.b.column + splat6(t) * c.b.column;
        return r;
    }

    std::size_t contacts() const { return w.candidates.size(); }
    const Candidate& contact(std::size_t k) const { return w.candidates[k]; }
    int place(std::size_t k) const { return w.candidates[k].place.element; }
    const ContactRow& normal(std::size_t k) const { return w.candidates[k].hn; }
    const ContactRow& tangent(std::size_t k, int i) const { return w.candidates[k].ht[i]; }
    int lowest(std::size_t k) const { return place(k); }
    int highest(std::size_t k) const { return place(k) + 1; }
    bool follows(std::size_t k) const
    {
        return w.candidates[k].index == w.candidates[k - 1].index + 1;
    }
    int most_trials() const { return pivoting::kTrials; }
    int first() const { return wire.state.first; }
    int last() const { return wire.last(); }
    std::vector<Node6>& gradient() { return w.gradient; }
    std::vector<Node6>& right() { return w.right; }
    std::vector<Node6>& increment() { return w.increment; }
    std::vector<Trial>& trial() { return w.trial; }
    BlockTridiagonal& matrix() { return w.system; }
    double& last_shift() { return w.shift; }
    bool has_compliant_walls() const { return w.compliant_walls != nullptr; }
    CompliantContacts linearise_walls(std::vector<int> which)
    {
        return amontons::linearise_walls(*w.compliant_walls, w.candidates, std::move(which),
                                         w.proximity);
    }
    std::array<ContactRow, 2> point_rows(std::size_t k) const
    {
        return amontons::point_rows(wire, w.candidates[k]);
    }
    bool pivot_compliant(const Residual& res, const NewtonOptions& options, double& shift,
                         NewtonReport& report)
    {
        return pivoting::pivot_compliant(*this, res, options, shift, report);
    }
    double min_stiffness() const
    {
        return *std::min_element(wire.material.stiffness.begin(), wire.material.stiffness.end());
    }
    void start_matrix(double shift, int from)
    {
        w.system.copy_from(w.base, from);
        if (shift > 0)
            for (int i = std::max(from, wire.state.first + 1); i <= wire.last(); ++i) {
                const double h = wire.material.law[std::size_t(i) - 1].length;
                Block6& d = w.system.diagonal(i);
                for (int a = 0; a < 3; ++a) {
                    d(a, a) += shift;
                    d(a + 3, a + 3) += shift * h * h;
                }
            }
    }
};

} // namespace

void close_active_rows(const Wire& wire, NewtonWorkspace& w, double force)
{
    ChainSystem s{wire, w};
    pivoting::close_active(s, force);
}

void solve_linearised(const Wire& wire, NewtonWorkspace& w, const Residual& res,
                      const NewtonOptions& options, double& shift, NewtonReport& report)
{
    ChainSystem s{wire, w};
    pivoting::solve(s, res, options, shift, report);
}

} // namespace amontons
