#include "solver/body/solid_body.hpp"

// The generalised-alpha rule of a solid: what it carries from step to step, in space.

namespace amontons {

Eigen::VectorXd SolidBody::damping_forces(const Motion& m) const
{
    Eigen::VectorXd f = Eigen::VectorXd::Zero(m.v.size());
    if (input_.mass_damping > 0) f += input_.mass_damping * into_frame(mass_times(m.v));
    if (input_.stiffness_damping > 0)
        f += input_.stiffness_damping * rate_forces(into_frame(m.v));
    return f;
}

Eigen::VectorXd SolidBody::rate_forces(const Eigen::VectorXd& v) const
{
    if (!corotational_) return stiffness_times(v);
    Eigen::VectorXd f = Eigen::VectorXd::Zero(v.size());
    ElementVector of_element, forces;
    for_each_element(mesh_, [&](std::int32_t e, ElementKind, std::span<const std::int32_t> nodes) {
        of_element.resize(3 * Eigen::Index(nodes.size()));
        for (std::size_t i = 0; i < nodes.size(); ++i)
            of_element.segment<3>(3 * Eigen::Index(i)) = v.segment<3>(3 * nodes[i]);
        corotational_rate_forces(elements_[std::size_t(e)], element_states_[std::size_t(e)],
                                 of_element, forces);
        for (std::size_t i = 0; i < nodes.size(); ++i)
            f.segment<3>(3 * nodes[i]) += forces.segment<3>(3 * Eigen::Index(i));
    });
    return f;
}

/// As they are kept with the state.
std::array<Eigen::VectorXd*, 6> SolidBody::carried_on()
{
    Memory& m = memory_;
    return {&m.elastic,           &m.inner,          &m.load,
            &m.filtered_velocity, &m.filtered_inner, &m.filtered_load};
}

/// Forces at the state, which are those of now_ too; at the first step also what is carried.
void SolidBody::begin_memory()
{
    if (!memory_.begun) {
        Eigen::VectorXd elastic;
        inner_forces(now_, elastic);
        memory_.elastic = into_space(elastic);
        memory_.inner = into_space(elastic + damping_forces(now_));
        memory_.load = into_space(loads(now_, step_.start));
        memory_.filtered_velocity = state_.v;
        memory_.filtered_inner = memory_.inner;
        memory_.filtered_load = memory_.load;
        memory_.begun = true;
    }
    past_velocity_ = step_.rule.past(state_.v, memory_.filtered_velocity);
    past_inner_ = step_.rule.past(memory_.inner, memory_.filtered_inner);
    past_load_ = step_.rule.past(memory_.load, memory_.filtered_load);
}

Eigen::VectorXd SolidBody::filtered_residual(Eigen::VectorXd& scale)
{
    Eigen::VectorXd inner;
    inner_forces(now_, inner);
    last_elastic_ = into_space(inner);
    inner = step_.rule.end * (inner + damping_forces(now_)) + into_frame(past_inner_);
    last_inner_ = into_space(inner);
    last_load_ = step_.rule.end * loads(now_, step_.end()) + into_frame(past_load_);
    const Eigen::VectorXd momentum = into_frame(mass_times(now_.v - state_.v));
    scale = momentum.cwiseAbs() + step_.h * (last_load_.cwiseAbs() + inner.cwiseAbs());
    return step_.h * (last_load_ - inner) - momentum;
}

/// What the rule and the damping take: the work of the mean inner forces and of the mean change of
/// momentum, less what energy they store.
/// @param momentum  of now_
double SolidBody::filtered_loss(const Eigen::VectorXd& momentum) const
{
    double loss = 0;
    for (std::size_t i = 0; i < now_.x.size(); ++i) {
        const Eigen::Index at = 3 * Eigen::Index(i);
        const Vec3 moved = now_.x[i] - state_.x[i];
        const Vec3 faster =
            moved / step_.h - 0.5 * Vec3(now_.v.segment<3>(at) + state_.v.segment<3>(at));
        loss += faster.dot(Vec3(momentum.segment<3>(at) - momenta().segment<3>(at)));
        loss +=
            moved.dot(Vec3(last_inner_.segment<3>(at) -
                           0.5 * (last_elastic_.segment<3>(at) + memory_.elastic.segment<3>(at))));
    }
    return loss;
}

/// Carries on to the end of the step.
/// @param start_velocity  of the state that the step began with
/// @param elastic         forces of the material at the end, in the frame
void SolidBody::end_memory(const Eigen::VectorXd& start_velocity, const Eigen::VectorXd& elastic)
{
    const TimeRule& rule = step_.rule;
    const Eigen::VectorXd inner = into_space(elastic + damping_forces(now_)),
                          load = into_space(loads(now_, step_.end()));
    Memory& m = memory_;
    m.filtered_velocity = rule.next(now_.v, start_velocity, m.filtered_velocity);
    m.filtered_inner = rule.next(inner, m.inner, m.filtered_inner);
    m.filtered_load = rule.next(load, m.load, m.filtered_load);
    m.elastic = into_space(elastic);
    m.inner = inner;
    m.load = load;
}

} // namespace amontons
