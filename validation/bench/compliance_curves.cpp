// What W = H A^-1 H^T of a solid costs, against the nodes of its mesh and the number of contacts.
//
//     compliance_curves [DIR] [NODES]   CSV files and SVG plots into DIR (default docs/results);
//                                       meshes of at most NODES nodes (default 45000)
//
// Cubes of T4, held below, contacts at random points of the face above (three nodes each). Compared
// are: columns kept from the first contact on (ours), W by the factor's tree (ours, keeps nothing),
// the inverse of the whole surface beforehand, and a solve with the factor in each of 100
// iterations of a contact solver. CPU time of one thread, the best of some repeats. The
// inverse of the whole surface is timed on 96 of its columns.

#include "mesh/extract_surface.hpp"
#include "mesh/generate/solid_box.hpp"
#include "solver/solid/compliance.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fmt/format.h>
#include <random>

using namespace amontons;

namespace {

constexpr int kIterations = 100; // of a contact solver
constexpr Eigen::Index kSample = 96;

double cpu_seconds()
{
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

/// Best of several, for at least 50 ms and at least twice.
template <class Work> double seconds_of(Work work)
{
    double best = 1e300, spent = 0;
    for (int k = 0; k < 2 || (spent < 0.05 && k < 200); ++k) {
        const double before = cpu_seconds();
        work();
        const double now = cpu_seconds() - before;
        best = std::min(best, now);
        spent += now;
    }
    return best;
}

struct Point {
    std::size_t nodes = 0, surface = 0, contacts = 0, in_contact = 0;
    double order = 0, factor = 0, gigabytes = 0;
    double first_contact = 0, kept = 0, surface_moves = 0, tree = 0, solve = 0;
    double surface_inverse = 0, surface_gigabytes = 0;
};

/// Points in faces of z_max that share no node while there are such, free x 3 contacts; the same
/// for the same mesh and count.
SparseMatrix random_contacts(const VolumeMesh& mesh, const FreeDofs& dofs, std::size_t count)
{
    std::vector<FaceRef> all = find_set(mesh.face_sets, "z_max")->members, faces, others;
    std::mt19937 engine(1);
    std::shuffle(all.begin(), all.end(), engine);
    std::vector<char> taken(mesh.nodes.size(), 0);
    for (const FaceRef f : all) {
        const FaceNodes face = face_nodes(mesh, f);
        bool apart = true;
        for (const std::int32_t node : face.nodes())
            apart = apart && !taken[std::size_t(node)];
        (apart ? faces : others).push_back(f);
        for (const std::int32_t node : face.nodes())
            if (apart) taken[std::size_t(node)] = 1;
    }
    faces.insert(faces.end(), others.begin(), others.end());
    std::uniform_real_distribution<> share(0, 1);
    std::vector<Eigen::Triplet<double>> entries;
    for (std::size_t i = 0; i < count; ++i) {
        const FaceNodes face = face_nodes(mesh, faces[i % faces.size()]);
        const double a = std::sqrt(share(engine)), b = share(engine);
        const double weight[] = {1 - a, a * (1 - b), a * b};
        for (std::size_t k = 0; k < 3; ++k)
            for (int axis = 0; axis < 3; ++axis)
                entries.emplace_back(dofs.number[std::size_t(3 * face.node[k] + axis)],
                                     3 * int(i) + axis, weight[k]);
    }
    SparseMatrix C(Eigen::Index(dofs.free.size()), 3 * Eigen::Index(count));
    C.setFromTriplets(entries.begin(), entries.end());
    return C;
}

std::vector<Point> measure(std::int32_t cells, std::span<const std::size_t> contact_counts)
{
    SolidBoxOptions box;
    box.cells = {cells, cells, cells};
    box.kind = ElementKind::T4;
    const VolumeMesh mesh = make_solid_box(box);
    const SolidPattern pattern = make_pattern(mesh);
    const SolidMaterial material{1e9, 0.3, 0};
    std::vector<std::int32_t> fixed;
    for (const std::int32_t node : nodes_of(mesh, *find_set(mesh.face_sets, "z_min")))
        for (int a = 0; a < 3; ++a)
            fixed.push_back(3 * node + a);
    const FreeDofs dofs = make_free_dofs(pattern, fixed);
    std::vector<std::int32_t> node_of_dof;
    for (const std::int32_t dof : dofs.free)
        node_of_dof.push_back(dof / 3);

    // ---- Order, factor, a solve
    Point common;
    common.nodes = mesh.nodes.size();
    SupernodalFactor factor;
    {
        SparseMatrix K = zero_matrix(pattern);
        assemble_stiffness(mesh, pattern, {&material, 1}, K);
        const SparseMatrix free = make_elimination(K, dofs).ff;
        double before = cpu_seconds();
        factor.analyse(free, node_of_dof);
        common.order = cpu_seconds() - before;
        before = cpu_seconds();
        if (!factor.factor(free)) std::abort();
        common.factor = cpu_seconds() - before;
    }
    common.gigabytes = 8e-9 * double(factor.stored_entries());
    const std::vector<std::int32_t> surface = extract_surface(mesh).used_nodes;
    common.surface = surface.size();
    SolidCompliance compliance(std::move(factor), dofs, surface, std::size_t(2) << 30);

    Eigen::VectorXd f = Eigen::VectorXd::Ones(3 * Eigen::Index(mesh.nodes.size()));
    common.solve = seconds_of([&] { f = compliance.displacement(f); });
    // ---- The inverse of the surface, from some of its columns
    std::vector<std::int32_t> of_surface;
    for (const std::int32_t node : surface)
        for (int a = 0; a < 3; ++a)
            if (const std::int32_t k = dofs.number[std::size_t(3 * node + a)]; k >= 0)
                of_surface.push_back(k);
    {
        std::vector<std::int32_t> some;
        for (Eigen::Index k = 0; k < kSample; ++k)
            some.push_back(of_surface[std::size_t(k) * of_surface.size() / std::size_t(kSample)]);
        Eigen::MatrixXd part(Eigen::Index(of_surface.size()), kSample);
        const double before = cpu_seconds();
        compliance.factor().inverse_part(of_surface, some, part);
        common.surface_inverse =
            (cpu_seconds() - before) * double(of_surface.size()) / double(kSample);
        common.surface_gigabytes = 8e-9 * double(of_surface.size()) * double(of_surface.size());
    }

    // ---- W against the number of contacts
    std::vector<Point> points;
    for (const std::size_t count : contact_counts) {
        SolidCompliance* const kept = &compliance;
        Point p = common;
        p.contacts = count;
        const SparseMatrix rows = random_contacts(mesh, dofs, count);
        Eigen::MatrixXd W;
        const std::int64_t solved = compliance.counts().columns_solved;
        std::vector<std::int32_t> touched;
        for (Eigen::Index k = 0; k < rows.nonZeros(); ++k)
            touched.push_back(dofs.free[std::size_t(rows.innerIndexPtr()[k])] / 3);
        const double before = cpu_seconds();
        kept->prepare(touched);
        p.first_contact = cpu_seconds() - before;
        p.in_contact = std::size_t(compliance.counts().columns_solved - solved);
        p.kept = seconds_of([&] { kept->delassus(rows, W); });
        Eigen::VectorXd forces = Eigen::VectorXd::Zero(3 * Eigen::Index(surface.size())), moves;
        for (std::size_t s = 0; s < surface.size(); ++s)
            for (int axis = 0; axis < 3; ++axis)
                if (const auto k = dofs.number[std::size_t(3 * surface[s] + axis)]; k >= 0)
                    forces[3 * Eigen::Index(s) + axis] = rows.row(k).sum();
        p.surface_moves = seconds_of([&] { moves = kept->surface_displacement(forces); });
        Eigen::MatrixXd once;
        p.tree = seconds_of([&] { compliance.factor().compliance(rows, once); });
        if (!((W - once).norm() < 1e-9 * W.norm())) std::abort();
        points.push_back(p);
        if (compliance.counts().from_factor > 0) std::abort();
    }
    return points;
}

void plot(const std::string& directory, const std::string& name, const char* title, int x,
          const char* x_title)
{
    FILE* pipe = popen("gnuplot", "w");
    if (!pipe) return;
    fmt::print(
        pipe,
        "set terminal svg size 760,520 background 'white'\nset output '{0}/{1}.svg'\n"
        "set datafile separator ','\nset logscale xy\nset grid\nset key outside below\n"
        "set title '{2}'\nset xlabel '{3}'\nset ylabel 'CPU time [ms]'\n"
        "set format y '10^{{%T}}'\n"
        "plot '{0}/{1}.csv' skip 1 using {4}:9 with linespoints lw 2 title "
        "'W from kept columns', '' skip 1 using {4}:11 with linespoints lw 2 title "
        "'W by the tree', '' skip 1 using {4}:({5}*$12) with linespoints title "
        "'{5} solves', '' skip 1 using {4}:8 with linespoints dt 2 title "
        "'once: columns at first contact', '' skip 1 using {4}:($6*1e3) with linespoints dt 2 "
        "title 'once: factor', '' skip 1 using {4}:($13*1e3) with linespoints dt 2 title "
        "'once: inverse of the surface'\n",
        directory, name, title, x_title, x, kIterations);
    pclose(pipe);
}

class Table {
public:
    explicit Table(const std::string& path) : file_(std::fopen(path.c_str(), "w"))
    {
        if (!file_) {
            fmt::print(stderr, "{} cannot be written\n", path);
            std::exit(2);
        }
        write("nodes,surface nodes,contacts,new nodes in contact,order [s],factor [s],L [GB],"
              "first contact [ms],W kept columns [ms],surface moves [ms],W tree [ms],"
              "one solve [ms],surface inverse [s],surface inverse [GB]\n");
    }
    ~Table() { std::fclose(file_); }
    Table(const Table&) = delete;
    Table& operator=(const Table&) = delete;
    void add(const Point& p)
    {
        write(fmt::format("{},{},{},{},{:.3f},{:.3f},{:.4f},{:.2f},{:.3f},{:.3f},{:.2f},{:.3f},"
                          "{:.1f},{:.2f}\n",
                          p.nodes, p.surface, p.contacts, p.in_contact, p.order, p.factor,
                          p.gigabytes, 1e3 * p.first_contact, 1e3 * p.kept, 1e3 * p.surface_moves,
                          1e3 * p.tree, 1e3 * p.solve, p.surface_inverse, p.surface_gigabytes));
    }

private:
    void write(const std::string& line)
    {
        fmt::print(file_, "{}", line);
        fmt::print("{}", line);
        std::fflush(file_);
        std::fflush(stdout);
    }
    FILE* file_;
};

} // namespace

int main(int argc, char** argv)
{
    if (argc > 1 && argv[1][0] == '-') {
        fmt::print(stderr, "compliance_curves [FOLDER] [most nodes]\n");
        return 2;
    }
    const std::string directory = argc > 1 ? argv[1] : "docs/results";
    const long most = argc > 2 ? std::atol(argv[2]) : 45000;
    std::filesystem::create_directories(directory);
    {
        Table table(directory + "/compliance_nodes.csv");
        for (const std::int32_t cells : {16, 20, 26, 33, 42, 58})
            if (std::pow(cells + 1, 3) <= double(most))
                for (const Point& p : measure(cells, std::vector<std::size_t>{50}))
                    table.add(p);
    }
    plot(directory, "compliance_nodes", "50 contacts on a cube of T4", 1, "nodes of the mesh");
    {
        Table table(directory + "/compliance_contacts.csv");
        const std::vector<std::size_t> counts{5, 10, 20, 50, 100, 200, 400};
        for (const Point& p : measure(24, counts))
            table.add(p);
    }
    plot(directory, "compliance_contacts", "a cube of T4 with 15 625 nodes", 3, "contacts");
    return 0;
}
