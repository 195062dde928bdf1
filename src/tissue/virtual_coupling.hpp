// The simulated operator that leads an instrument: a mass with damping and a virtual coupling towards the scripted
// target, pushed back by contact (METHODS §11). Translation only; rotation and jaw follow the script.
#pragma once

#include <Eigen/Cholesky>
#include <span>
#include <vector>

#include "contact/response_output.hpp"
#include "scene/motion.hpp"
#include "scene/world.hpp"

namespace trocar {

struct OperatorState {
    Vector3 position = Vector3::Zero();  ///< m, of the body origin, world
    Vector3 velocity = Vector3::Zero();  ///< m/s
};

/// One hand, the bodies it holds (they share its pose), and what becomes of it in a tick.
struct DrivenOperator {
    const OperatorModel* model = nullptr;
    std::span<const Index> bodies = {};
    Vector3 target = Vector3::Zero();           ///< m, world
    Vector3 target_velocity = Vector3::Zero();  ///< m/s
    Wrench external = {};      ///< constant over the tick: what tissue gave back, and the output's own wrenches
    OperatorState state = {};  ///< in and out
    Wrench load = {};          ///< out: mean of contacts and `external` over the tick, moments about the world origin
    double work = 0.0;         ///< out: J, of that load on the hand, step by step
};

/// Advances all hands over dt in `substeps` semi-implicit steps: virtual couplings and damping explicit, contacts
/// implicit and solved for all hands together, so that two hands that press on each other do not both give way to the
/// same depth. Contacts of the output act when they push vertices of a hand's bodies, or react on one of its bodies,
/// without moving tissue; contacts with tissue come as DrivenOperator::external.
class VirtualCouplings {
public:
    /// `frame` gives the vertex velocities for which gaps and face velocities were written, and what of them hands gave
    /// (operator_motion); what scripts move goes on within the tick. Writes to `loads`, one per
    /// contact of the output, what the contacts gave that act here. Memory is kept.
    void advance(const Topology& topology, const Frame& frame, const ResponseOutput& output, double dt, int substeps,
                 std::span<DrivenOperator> operators, std::span<ContactForce> loads);

private:
    /// A contact as the hands see it: v_plus·n − v_minus·n + offset is its rate.
    struct Row {
        std::size_t source = 0;  ///< contact of the output
        Index plus = -1;         ///< hand that is pushed along the normal, -1: none
        Index minus = -1;        ///< hand that takes the reaction
        Vector3 normal = Vector3::Zero();
        Vector3 plus_point = Vector3::Zero();
        Vector3 minus_point = Vector3::Zero();
        double first_depth = 0.0;  ///< m, at the start of the tick
        double offset = 0.0;       ///< m/s, part of the rate that no hand gives
        double stiffness = 0.0;
        double damping = 0.0;           ///< >= 0, implicit
        double explicit_damping = 0.0;  ///< <= 0
        StepLaw law;                    ///< of the sub-step
        double limit = 0.0;             ///< N, largest force
        bool adhesive = false;
        bool bilateral = false;
        double depth = 0.0;  ///< m, at the start of the sub-step; negative: open
        bool on = false;
        bool capped = false;  ///< on, and at its limit
        double force = 0.0;   ///< N, of the sub-step, within the limit
    };

    void collect(const Topology& topology, const Frame& frame, const ResponseOutput& output, double dt,
                 std::span<const DrivenOperator> operators);
    [[nodiscard]] double rate(const Row& row, const Eigen::VectorXd& velocity) const;
    void solve(double h, std::span<const DrivenOperator> operators);

    std::vector<Row> rows_;
    std::vector<Vector3> first_position_;
    Eigen::MatrixXd matrix_;
    Eigen::VectorXd start_, free_, right_side_, velocity_, solved_;
    Eigen::LDLT<Eigen::MatrixXd> factor_;
};

}  // namespace trocar
