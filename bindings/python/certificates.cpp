#include "bindings/python/common.hpp"
#include "contact/solution.hpp"

// Certificates: of a step, and of a contact problem with its solution.

namespace amontons::python {
namespace {

py::object overlap_of(const StepCertificate& c)
{
    py::dict o;
    o["depth"] = c.worst_overlap.depth;
    o["a"] = c.worst_overlap.a;
    o["b"] = c.worst_overlap.b;
    o["point"] = py::make_tuple(c.worst_overlap.point.x(), c.worst_overlap.point.y(),
                                c.worst_overlap.point.z());
    return read_only(o);
}

py::array vector_view(const std::shared_ptr<ContactSolution>& s, const Eigen::VectorXd& v)
{
    return view<double>(s, v.data(), {{v.size()}, {8}});
}

} // namespace

void add_certificates(py::module_& module)
{
    using S = StepCertificate;
    py::class_<S>(module, "StepCertificate", py::module_local(),
                  "Errors of an accepted step, recomputed from its state alone.")
        .def_readonly("error", &S::error, "natural map and equilibrium, relative")
        .def_readonly("tolerance", &S::tolerance, "relative")
        .def_readonly("certified", &S::certified, "error <= tolerance")
        .def_readonly("worst_penetration", &S::worst_penetration, "of the contacts' gaps [m]")
        .def_readonly("worst_cone_violation", &S::worst_cone_violation, "[N]")
        .def_readonly("worst_contact", &S::worst_contact, "into the step's contacts, or -1")
        .def_property_readonly(
            "worst_overlap", overlap_of,
            "the place where two bodies stand deepest in each other, measured on "
            "their surfaces: depth [m] (0: nowhere, nan: not measured), a, b, "
            "point [m]")
        .def("__repr__", [](const S& c) {
            return "<StepCertificate: error " + std::string(py::str(py::float_(c.error))) + ", " +
                   (c.certified ? "certified" : "not certified") + ">";
        });

    using C = Certificate;
    py::class_<C>(module, "Certificate", py::module_local(),
                  "How good a reaction is, computed from (W, q, mu, r) alone.")
        .def_property_readonly(
            "status", [](const C& c) { return name(c.status); },
            "'converged', 'at_round_off', 'stagnated', 'infeasible' or 'out_of_time'")
        .def_readonly("error", &C::error, "natural map, relative")
        .def_readonly("tolerance", &C::tolerance, "as requested, relative")
        .def_readonly("threshold", &C::threshold,
                      "the tolerance, or the floor of round-off if that is larger")
        .def_readonly("scaled_error", &C::scaled_error,
                      "each contact in its own scale: sees the stiff ones")
        .def_readonly("worst_penetration", &C::worst_penetration, "[m]")
        .def_readonly("worst_cone_violation", &C::worst_cone_violation, "[N]")
        .def_readonly("worst_dissipation", &C::worst_dissipation, "[J]")
        .def_readonly("worst_contact", &C::worst_contact, "-1 without contacts")
        .def_readonly("contacts", &C::contacts, "their number")
        .def_property_readonly(
            "rank_deficient",
            [](const C& c) {
                return c.analysed ? py::object(py::bool_(c.rank_deficient)) : py::none();
            },
            "W is singular; None if it was not analysed")
        .def_property_readonly(
            "indefinite",
            [](const C& c) {
                return c.analysed ? py::object(py::bool_(c.indefinite)) : py::none();
            },
            "W has a negative eigenvalue; None if it was not analysed")
        .def_property_readonly(
            "proof_contacts", [](const C& c) { return py::tuple(py::cast(c.proof.contacts)); },
            "of an infeasible problem: contacts that no reaction keeps apart")
        .def("__repr__", [](const C& c) { return "<Certificate: " + report(c) + ">"; });

    using K = ContactSolution;
    py::class_<K, std::shared_ptr<K>>(
        module, "ContactSolution", py::module_local(),
        "The best reaction found, with its certificate. True if its error is below the requested tolerance.")
        .def("__bool__", [](const K& s) { return is_solved(s.certificate.status); })
        .def_property_readonly(
            "status", [](const K& s) { return name(s.certificate.status); },
            "'converged', 'at_round_off', 'stagnated', 'infeasible' or 'out_of_time'")
        .def_property_readonly(
            "error", [](const K& s) { return s.certificate.error; }, "natural map, relative")
        .def_property_readonly("iterations", [](const K& s) { return s.certificate.iterations; })
        .def_property_readonly(
            "seconds", [](const K& s) { return s.certificate.seconds; }, "wall time")
        .def_property_readonly(
            "solver", [](const K& s) { return name(s.certificate.solver); }, "the one that ran")
        .def_property_readonly(
            "reaction", [](const std::shared_ptr<K>& s) { return vector_view(s, s->reaction); },
            "(rows,) r, contact by contact (n, t1, t2) [N or N s], read-only")
        .def_property_readonly(
            "u", [](const std::shared_ptr<K>& s) { return vector_view(s, s->u); },
            "(rows,) W r + q: gap and slip [m], or velocity [m/s], read-only")
        .def_property_readonly("certificate", [](const K& s) { return s.certificate; })
        .def_property_readonly(
            "history",
            [](const K& s) {
                py::array_t<double> a({py::ssize_t(s.history.size()), py::ssize_t(3)});
                double* out = a.mutable_data();
                for (const ErrorPoint& p : s.history)
                    for (const double v : {double(p.iteration), p.seconds, p.error})
                        *out++ = v;
                return a;
            },
            "(k, 3) iteration, seconds, error on the way")
        .def("__repr__",
             [](const K& s) { return "<ContactSolution: " + report(s.certificate) + ">"; });
}

} // namespace amontons::python
