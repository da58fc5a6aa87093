#include "solver/body/solid_memory.hpp"
#include "solver/body/node_index.hpp"

#include <Eigen/LU>

namespace amontons {

void begin_memory(const Eigen::VectorXd& velocity, const Eigen::VectorXd& elastic,
                  const Eigen::VectorXd& inner, const Eigen::VectorXd& load, SolidMemory& memory)
{
    memory = {true, elastic, inner, load, velocity, inner, load};
}

PastShares past_shares(const TimeRule& rule, const SolidMemory& memory,
                       const Eigen::VectorXd& velocity)
{
    PastShares past;
    past.velocity = rule.past(velocity, memory.filtered_velocity);
    past.inner = rule.past(memory.inner, memory.filtered_inner);
    past.load = rule.past(memory.load, memory.filtered_load);
    return past;
}

double filtered_loss(const SolidMotion& state, const SolidMotion& now, double h,
                     const LastForces& last, const SolidMemory& memory,
                     const Eigen::VectorXd& start_momentum, const Eigen::VectorXd& momentum)
{
    double loss = 0;
    for (std::size_t i = 0; i < now.x.size(); ++i) {
        const Eigen::Index at = at3(i);
        const Vec3 moved = now.x[i] - state.x[i];
        const Vec3 faster = moved / h - 0.5 * Vec3(now.v.segment<3>(at) + state.v.segment<3>(at));
        loss += faster.dot(Vec3(momentum.segment<3>(at) - start_momentum.segment<3>(at)));
        loss += moved.dot(Vec3(last.inner.segment<3>(at) - 0.5 * (last.elastic.segment<3>(at) +
                                                                  memory.elastic.segment<3>(at))));
    }
    return loss;
}

void end_memory(const TimeRule& rule, const Eigen::VectorXd& start_velocity,
                const Eigen::VectorXd& velocity, const Eigen::VectorXd& elastic,
                const Eigen::VectorXd& inner, const Eigen::VectorXd& load, SolidMemory& memory)
{
    memory.filtered_velocity = rule.next(velocity, start_velocity, memory.filtered_velocity);
    memory.filtered_inner = rule.next(inner, memory.inner, memory.filtered_inner);
    memory.filtered_load = rule.next(load, memory.load, memory.filtered_load);
    memory.elastic = elastic;
    memory.inner = inner;
    memory.load = load;
}

// All of it about the body's own centre: a load that passes there turns nothing, however fast the
// body flies.
double keep_angular_momentum(const SolidModel& model, const StepInput& step,
                             const SolidMotion& state, const SolidStateForces& at_state,
                             const SolidContactForces& contact,
                             const std::optional<Vec3>& contact_moment, const Eigen::VectorXd& load,
                             const Eigen::VectorXd& reached, SolidMotion& now)
{
    // Damping takes some, too: not that of rates of strain, whose forces have no moment.
    if (model.input.mass_damping > 0 || (model.input.stiffness_damping > 0 && !model.corotational))
        return 0;
    const double h = step.h, end = step.rule.end, theta = step.rule.filtered ? 0.5 : end;
    const auto sum = [](const Eigen::VectorXd& v) {
        return Vec3(Eigen::Map<const Eigen::Matrix3Xd>(v.data(), 3, v.size() / 3).rowwise().sum());
    };
    // The centre of the consistent mass: a turn about it has no momentum.
    const double mass = model.weights->sum();
    const auto centre_of = [&](const std::vector<Vec3>& x) {
        return Vec3(Eigen::Map<const Eigen::Matrix3Xd>(x.front().data(), 3, model.weights->size()) *
                    *model.weights / mass);
    };
    const Vec3 x0 = centre_of(state.x), x1 = centre_of(now.x);
    const Eigen::VectorXd pushed = into_space(now, contact.on_unknowns);
    Eigen::VectorXd arms(now.v.size());
    Vec3 own = Vec3::Zero(), missing = Vec3::Zero(); // own: of contacts where the nodes move
    for (std::size_t i = 0; i < now.x.size(); ++i) {
        const Vec3 arm = now.x[i] - x1, before = state.x[i] - x0;
        missing += before.cross(Vec3(at_state.momentum.segment<3>(at3(i)))) +
                   ((1 - theta) * before + theta * arm).cross(h * Vec3(load.segment<3>(at3(i)))) -
                   arm.cross(Vec3(reached.segment<3>(at3(i))));
        own += arm.cross(Vec3(pushed.segment<3>(at3(i))));
        arms.segment<3>(at3(i)) = arm;
    }
    // As a rigid body: the centre continues to x1 with a share of the end velocity, whose momentum
    // has no moment about it.
    const Vec3 passed = x1 - h * end / mass * sum(reached);
    missing += contact_moment ? Vec3(*contact_moment - passed.cross(sum(pushed))) : own;
    const Eigen::VectorXd weighted = mass_times(model, arms);
    Mat3 S = Mat3::Zero();
    Vec3 momentum = Vec3::Zero();
    for (std::size_t i = 0; i < now.x.size(); ++i) {
        const Vec3 arm = arms.segment<3>(at3(i));
        S += arm * weighted.segment<3>(at3(i)).transpose();
        momentum += arm.cross(Vec3(reached.segment<3>(at3(i))));
    }
    const Mat3 inertia = S.trace() * Mat3::Identity() - 0.5 * (S + S.transpose());
    const Vec3 spin = inertia.inverse() * missing;
    for (std::size_t i = 0; i < now.x.size(); ++i)
        now.v.segment<3>(at3(i)) += spin.cross(Vec3(arms.segment<3>(at3(i))));
    return spin.dot(momentum + 0.5 * missing);
}

} // namespace amontons
