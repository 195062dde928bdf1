#include "tissue/virtual_coupling.hpp"

#include <algorithm>
#include <cmath>

namespace trocar {
namespace {

Index operator_of(std::span<const DrivenOperator> operators, Index body) {
    for (std::size_t coupling = 0; coupling < operators.size(); ++coupling) {
        const std::span<const Index> bodies = operators[coupling].bodies;
        if (std::find(bodies.begin(), bodies.end(), body) != bodies.end()) return static_cast<Index>(coupling);
    }
    return -1;
}

}  // namespace

/// Collects the contacts that involve an operator and no tissue.
void VirtualCouplings::collect(const Topology& topology, const Frame& frame, const ResponseOutput& output, double dt,
                               std::span<const DrivenOperator> operators) {
    rows_.clear();
    for (std::size_t c = 0; c < output.contacts.size(); ++c) {
        const ContactForceLaw& contact = output.contacts[c];
        Row row;
        row.source = c;
        bool pushes_tissue = false;
        row.offset = -contact.face_velocity;
        for (std::size_t i = 0; i < 3; ++i) {
            const Index vertex = contact.vertices[i];
            if (vertex < 0 || contact.weights[i] == 0.0) continue;
            const Index body = topology.body_of_vertex(vertex);
            pushes_tissue = pushes_tissue || topology.bodies[at(body)].kind == BodyKind::tissue;
            if (row.plus < 0) row.plus = operator_of(operators, body);
            const Vector3 scripted = frame.velocity.col(vertex) - frame.operator_velocity(body, dt);
            row.offset += contact.weights[i] * scripted.dot(contact.normal);
            row.plus_point += contact.weights[i] * frame.position.col(vertex);
        }
        if (pushes_tissue) continue;
        if (contact.reaction_body >= 0) {
            row.minus = operator_of(operators, contact.reaction_body);
            row.offset += frame.operator_velocity(contact.reaction_body, dt).dot(contact.normal);
        }
        if (row.plus < 0 && row.minus < 0) continue;
        row.minus_point = contact.reaction_point;
        row.normal = contact.normal;
        row.first_depth = -contact.gap;
        row.stiffness = contact.k;
        row.damping = std::max(contact.mu, 0.0);
        row.explicit_damping = std::min(contact.mu, 0.0);
        row.bilateral = contact.bilateral();
        row.pulls = contact.pulls();
        row.limit = contact.limit;
        rows_.push_back(row);
    }
}

double VirtualCouplings::rate(const Row& row, const Eigen::VectorXd& velocity) const {
    double sum = 0.0;
    if (row.plus >= 0) sum += velocity.segment<3>(3 * row.plus).dot(row.normal);
    if (row.minus >= 0) sum -= velocity.segment<3>(3 * row.minus).dot(row.normal);
    return sum + row.offset;
}

/// Solves (M + h Σ c Jᵀ J) v' = M v_free + h Σ F(offset) Jᵀ; c is the slope of the law. J is n on the pushed operator
/// and −n on the other. Repeats without contacts that would pull and with open ones that would press.
void VirtualCouplings::solve(double h, std::span<const DrivenOperator> operators) {
    velocity_ = free_;
    constexpr int most_changes = 8;
    for (int change = 0; change < most_changes; ++change) {
        matrix_.setZero();
        for (std::size_t coupling = 0; coupling < operators.size(); ++coupling) {
            const auto row = static_cast<Eigen::Index>(3 * coupling);
            matrix_.block<3, 3>(row, row).diagonal().setConstant(operators[coupling].model->mass);
            right_side_.segment<3>(row) = operators[coupling].model->mass * free_.segment<3>(row);
        }
        for (Row& row : rows_) {
            const double speed = rate(row, velocity_);
            const double force = row.law.force(speed);
            if (row.bilateral) {
                row.on = true;
            } else if (row.pulls || change == 0) {
                row.on = row.depth >= 0.0;
            } else {
                row.on = force > 0.0;
            }
            row.capped = change > 0 && std::abs(force) > row.limit;
            row.force = std::clamp(force, -row.limit, row.limit);
            if (!row.on) continue;
            const Matrix3 block = (row.capped ? 0.0 : h * row.law.slope) * row.normal * row.normal.transpose();
            const Vector3 push = h * (row.capped ? row.force : row.law.force(row.offset)) * row.normal;
            if (row.plus >= 0) {
                matrix_.block<3, 3>(3 * row.plus, 3 * row.plus) += block;
                right_side_.segment<3>(3 * row.plus) += push;
            }
            if (row.minus >= 0) {
                matrix_.block<3, 3>(3 * row.minus, 3 * row.minus) += block;
                right_side_.segment<3>(3 * row.minus) -= push;
            }
            if (row.plus >= 0 && row.minus >= 0) {
                matrix_.block<3, 3>(3 * row.plus, 3 * row.minus) -= block;
                matrix_.block<3, 3>(3 * row.minus, 3 * row.plus) -= block;
            }
        }
        factor_.compute(matrix_);
        solved_ = factor_.solve(right_side_);
        const bool settled = change > 0 && (solved_ - velocity_).norm() <= 1e-12 * solved_.norm();
        velocity_.swap(solved_);
        if (settled) break;
    }
}

void VirtualCouplings::advance(const Topology& topology, const Frame& frame, const ResponseOutput& output, double dt,
                               int substeps, std::span<DrivenOperator> operators,
                               std::span<ContactForce> contact_forces) {
    if (operators.empty()) return;
    const int steps = std::max(1, substeps);
    const double h = dt / steps;
    const auto size = static_cast<Eigen::Index>(3 * operators.size());
    matrix_.resize(size, size);
    for (Eigen::VectorXd* vector : {&start_, &free_, &right_side_, &velocity_, &solved_}) vector->resize(size);
    first_position_.resize(operators.size());
    for (std::size_t i = 0; i < operators.size(); ++i) {
        start_.segment<3>(static_cast<Eigen::Index>(3 * i)) = operators[i].state.velocity;
        first_position_[i] = operators[i].state.position;
        operators[i].load = operators[i].external;
        operators[i].work = 0.0;
    }
    collect(topology, frame, output, dt, operators);
    for (const Row& row : rows_) contact_forces[row.source] = {};
    for (int step = 0; step < steps; ++step) {
        for (std::size_t i = 0; i < operators.size(); ++i) {
            const OperatorModel& model = *operators[i].model;
            const OperatorState& state = operators[i].state;
            const Vector3 pull = model.coupling_stiffness * (operators[i].target - state.position) +
                                 model.coupling_damping * (operators[i].target_velocity - state.velocity) -
                                 model.damping * state.velocity;
            free_.segment<3>(static_cast<Eigen::Index>(3 * i)) =
                state.velocity + h / model.mass * (pull + operators[i].external.force);
            start_.segment<3>(static_cast<Eigen::Index>(3 * i)) = state.velocity;
        }
        const auto moved = [&](Index coupling) -> Vector3 {
            return operators[at(coupling)].state.position - first_position_[at(coupling)];
        };
        for (Row& row : rows_) {
            double depth = row.first_depth;
            if (row.plus >= 0) depth -= moved(row.plus).dot(row.normal);
            if (row.minus >= 0) depth += moved(row.minus).dot(row.normal);
            depth -= step * h * row.offset;
            row.law = {row.stiffness, row.damping, depth, h, row.pulls};
            // Explicit (negative) damping acts at the velocity at the start of the sub-step.
            const bool closed = row.bilateral || depth >= 0.0;
            if (closed) row.law.still -= row.explicit_damping * rate(row, start_);
            row.depth = depth;
        }
        solve(h, operators);
        for (const Row& row : rows_) {
            ContactForce& load = contact_forces[row.source];
            load.at_limit = row.on && row.capped;
            if (!row.on) continue;
            const double pressed = row.capped ? row.force : row.law.force(rate(row, velocity_));
            load.normal += pressed / steps;
            const Vector3 force = pressed * row.normal;
            if (row.plus >= 0) operators[at(row.plus)].load.moment += row.plus_point.cross(force) / steps;
            if (row.minus >= 0) operators[at(row.minus)].load.moment -= row.minus_point.cross(force) / steps;
        }
        for (std::size_t i = 0; i < operators.size(); ++i) {
            const auto place = static_cast<Eigen::Index>(3 * i);
            const Vector3 change = velocity_.segment<3>(place) - free_.segment<3>(place);
            operators[i].load.force += operators[i].model->mass / (h * steps) * change;
            operators[i].state.velocity = velocity_.segment<3>(place);
            operators[i].work +=
                (operators[i].model->mass * change + h * operators[i].external.force).dot(operators[i].state.velocity);
            operators[i].state.position += h * operators[i].state.velocity;
        }
    }
}

}  // namespace trocar
