#include "solver/step/coaxial.hpp"
#include "solver/step/four_node_rows.hpp"
#include "solver/step/pivot_method.hpp"

namespace amontons {
namespace {

/// Several wires: rows on the nodes of one or two elements, a matrix of the common order.
struct CoaxialSystem : FourNodeRows<CoaxialContact> {
    Coaxial& c;

    explicit CoaxialSystem(Coaxial& coaxial) : c(coaxial) {}

    /// K += s f h^T, but only in rows and columns of which one is >= from.
    static void add_product(BlockSkyline& K, Place place, const Row& f, const Row& h, double s,
                            int from)
    {
        for (int a = 0; a < place.nodes; ++a) {
            const int row = place.slot[std::size_t(a)];
            const Column6 fa = f.node[a].column * splat6(s);
            for (int b = 0; b < place.nodes; ++b) {
                const int col = place.slot[std::size_t(b)];
                if (std::max(row, col) < from) continue;
                Block6& block = K.block(row, col);
                for (int j = 0; j < 6; ++j)
                    block.column[j] += fa * splat6(h.node[b].value[j]);
            }
        }
    }
    static Row row(const ContactRow& own, const ContactRow* other)
    {
        static const ContactRow none{{Column6{}}, {Column6{}}};
        if (!other) other = &none;
        return {{own.a, own.b, other->a, other->b}};
    }

    std::size_t contacts() const { return c.all.size(); }
    const Candidate& contact(std::size_t k) const { return *c.all[k].contact; }
    Place place(std::size_t k) const { return c.all[k]; }
    Row normal(std::size_t k) const
    {
        const CoaxialContact& p = c.all[k];
        return row(p.contact->hn, p.nested ? &p.nested->hn : nullptr);
    }
    Row tangent(std::size_t k, int i) const
    {
        const CoaxialContact& p = c.all[k];
        return row(p.contact->ht[i], p.nested ? &p.nested->ht[i] : nullptr);
    }
    int lowest(std::size_t k) const { return c.all[k].lowest; }
    int highest(std::size_t k) const { return c.all[k].highest; }
    bool follows(std::size_t k) const { return c.all[k].follows; }
    int most_trials() const { return pivoting::kTrials; }
    int first() const { return 0; }
    int last() const { return c.base.size() - 1; }
    std::vector<Node6>& gradient() { return c.gradient; }
    std::vector<Node6>& right() { return c.right; }
    std::vector<Node6>& increment() { return c.increment; }
    std::vector<Trial>& trial() { return c.trial; }
    BlockSkyline& matrix() { return c.system; }
    double& last_shift() { return c.shift; }
    double min_stiffness() const
    {
        double least = std::numeric_limits<double>::infinity();
        for (const WireBody* b : c.wires)
            for (double k : b->wire.material.stiffness)
                least = std::min(least, k);
        return least;
    }
    void weigh(std::vector<Node6>& x) const
    {
        for (std::size_t w = 0; w < c.wires.size(); ++w) {
            const Wire& wire = c.wires[w]->wire;
            if (!wire.outside()) continue;
            x[std::size_t(c.slot[w][std::size_t(wire.state.first)])].column = Column6{};
            for (int i = wire.state.first + 1; i <= wire.last(); ++i) {
                const double h = wire.material.law[std::size_t(i) - 1].length;
                double* turn = x[std::size_t(c.slot[w][std::size_t(i)])].value + 3;
                for (int a = 0; a < 3; ++a)
                    turn[a] *= h * h;
            }
        }
    }
    void start_matrix(double shift, int from)
    {
        c.system.copy_from(c.base, from);
        if (!(shift > 0)) return;
        for (std::size_t w = 0; w < c.wires.size(); ++w) {
            const Wire& wire = c.wires[w]->wire;
            for (int i = wire.state.first + 1; i <= wire.last(); ++i) {
                const int slot = c.slot[w][std::size_t(i)];
                if (slot < from) continue;
                const double h = wire.material.law[std::size_t(i) - 1].length;
                Block6& d = c.system.block(slot, slot);
                for (int a = 0; a < 3; ++a) {
                    d(a, a) += shift;
                    d(a + 3, a + 3) += shift * h * h;
                }
            }
        }
    }
};

} // namespace

void solve_linearised(Coaxial& c, const Residual& residual, const NewtonOptions& options,
                      double& shift, NewtonReport& report)
{
    CoaxialSystem s(c);
    pivoting::solve(s, residual, options, shift, report);
}

void close_active_rows(Coaxial& c, double force)
{
    CoaxialSystem s(c);
    pivoting::close_active(s, force);
}

} // namespace amontons
