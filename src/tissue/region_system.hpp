// One linearly implicit Euler step of all nodes that are awake in a RegionTissue, contacts in the same linear system:
// what presses adds its damper and its spring to the matrix, so that hundreds of contacts cost a few products with it.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tissue/region_kernels.hpp"
#include "tissue/region_levels.hpp"
#include "tissue/tick_contacts.hpp"

namespace trocar {

/// A spring of a vertex that is awake: what SpringArrays have of it, side by side with the others of the region.
struct RegionSpring {
    Index i = -1;  ///< of the state
    Index j = -1;
    double k = 0.0;             ///< N/m
    double offset = 0.0;        ///< N
    double damping = 0.0;       ///< N s/m
    double inverse_rest = 0.0;  ///< 1/m; 0 where the rest length is 0
    double sense = 1.0;         ///< 1 where its edge's own node is i, else -1
};

class RegionSystem {
public:
    RegionSystem(MovingTissue& tissue, RegionTissue& region);

    /// Linearises what is awake for a step of h (s).
    void prepare(double h);
    /// Finds the change of all velocities and what every contact gives: what is left open is at most `tolerance` of
    /// what the contacts give, or a tenth of that of all that acts. `known`: the normal forces are what the contacts
    /// hold.
    void solve(double h, bool known, double tolerance, int iterations, TickContacts& contacts);
    /// Moves what is awake by its new velocities. Gives the furthest that a coordinate has gone, m; not finite where
    /// the numbers are not.
    double move(double h);
    /// What contacts gave in the last step has no part in the next one.
    void forget() { pressed_.clear(); }

    /// Springs of vertices that are awake.
    [[nodiscard]] std::span<const RegionSpring> springs() const { return springs_; }

private:
    struct Node {
        std::uint32_t level = 0;
        Index node = -1;
    };
    /// A node that sleeps beside one that is awake: it moves as others do.
    struct Ghost {
        std::size_t number = 0;
        std::array<std::size_t, 3> parent{};
        std::array<double, 3> weight{};
    };
    /// How a contact acts in the matrix.
    struct Row {
        /// N, on P along the normal, after a step that ends with this rate (m/s).
        [[nodiscard]] double force(double after) const { return std::clamp(given - yield * after, least, most); }
        /// Whether that force depends on the rate.
        [[nodiscard]] bool gives_way(double after) const {
            const double wanted = given - yield * after;
            return yield > 0.0 && wanted > least && wanted < most;
        }
        [[nodiscard]] bool gives_way() const { return gives_way(rate); }
        /// kg, what it adds along its normal to the matrix of a step of h (s).
        [[nodiscard]] double pressing(double h) const { return gives_way() ? h * yield : 0.0; }
        /// Of a vector what is along the surface and not the way it slides.
        [[nodiscard]] Vector3 held(const Vector3& vector, const TickContact& contact) const {
            return contact.along_surface(vector) - vector.dot(slide) * slide;
        }
        void stop_rubbing() {
            has_friction = false;
            slope = 0.0;
            stretched.setZero();
            slide.setZero();
        }

        double given = 0.0;        ///< N, at rate 0
        double yield = 0.0;        ///< N s/m
        double least = 0.0;        ///< N
        double most = 0.0;         ///< N
        double rate = 0.0;         ///< m/s, by the change as it is
        double along = 0.0;        ///< m/s, what the direction adds to it
        double start_rate = 0.0;   ///< m/s, where a search along a direction begins
        double start_force = 0.0;  ///< N, there
        double now = 0.0;          ///< N, at that rate
        double press = 0.0;        ///< kg, along its normal, in the preconditioner and while a direction is searched
        bool couples = false;      ///< presses on several vertices, which the preconditioner knows
        double square = 0.0;       ///< kg m²/s² per N², of its force as residuals are measured without contacts
        // Along the surface it gives -stretched - slope held(speed after the step).
        bool has_friction = false;
        double slope = 0.0;                   ///< N s/m
        Vector3 stretched = Vector3::Zero();  ///< N
        Vector3 slide = Vector3::Zero();      ///< the way it slides; zero where it sticks
    };
    struct Pressed {
        std::uint64_t id = 0;  ///< of the contact
        double force = 0.0;    ///< N
    };
    struct Descent {
        int iterations = 0;
        bool strays = false;  ///< a contact does not give what it was held to give
    };
    /// So many of the first nodes that are awake, and of the first edges those with an end among them.
    struct Part {
        std::size_t nodes = 0;
        std::size_t edges = 0;
    };
    static constexpr std::size_t most_coupled = 256;  ///< a larger matrix takes longer to factor than a tick
    void list(double h);
    void sort_blocks();
    Index number_of(std::size_t level, Index node);
    void invert(std::size_t node, const Matrix3& block);
    void prolongate(Matrix4X& vector) const;
    void restrict_to_coarse(Matrix4X& vector) const;
    void multiply(const Part& part, const TickContacts& contacts);
    double precondition(double by, const Part& part, const TickContacts& contacts);
    void couple(const TickContacts& contacts);
    [[nodiscard]] double step_length(double h, double downhill, double curvature) const;
    void find_change(double h, const Part& part, double tolerance, int iterations, TickContacts& contacts);
    void stand_still();
    void begin_as_before(double h, TickContacts& contacts);
    void remember_forces(const TickContacts& contacts);
    void take_residual(double h, const Part& part, const TickContacts& contacts);
    Descent descend(const Part& part, double rho, double tolerance, int iterations, const TickContacts& contacts);
    void go_along(double h, const Part& part, const TickContacts& contacts);
    [[nodiscard]] bool is_settled(double rho, double tolerance) const;
    void close_momentum();
    [[nodiscard]] static double tangent_slope(double h, const TickContact& contact, const TickContacts& contacts);
    void stick(double h, std::size_t c, TickContacts& contacts);
    void slide(double h, std::size_t c, double most, const Vector3& pull, TickContacts& contacts);
    void take_laws(double h, bool known, TickContacts& contacts);
    /// What a contact gave in the last step, where it gave way in it.
    [[nodiscard]] const Pressed* pressed_before(std::uint64_t id) const;
    void take_rows(double h, const TickContacts& contacts);
    void take_blocks(double h, const TickContacts& contacts);
    void change_block(double h, std::size_t c, const TickContacts& contacts);
    double rub(double h, TickContacts& contacts);
    void stretch_slips(double h, TickContacts& contacts);
    /// Calls act(number in the system, weight) for the vertices of a contact.
    template <typename Act>
    void each_end(const TickContact& contact, const Act& act) const {
        for (std::size_t i = 0; i < static_cast<std::size_t>(contact.count); ++i) {
            act(number_[0][static_cast<std::size_t>(contact.vertex[i])], contact.weight[i]);
        }
    }
    /// N s, of a contact along its normal on what it touches.
    void push(const TickContact& contact, double impulse, Matrix4X& vector) const {
        each_end(contact,
                 [&](Eigen::Index n, double weight) { vector.col(n).head<3>() += weight * impulse * contact.normal; });
    }
    /// What a vector is along a contact's normal at P.
    [[nodiscard]] double along(const TickContact& contact, const Matrix4X& vector) const {
        double sum = 0.0;
        each_end(contact,
                 [&](Eigen::Index n, double weight) { sum += weight * vector.col(n).head<3>().dot(contact.normal); });
        return sum;
    }

    MovingTissue* tissue_;
    RegionTissue* region_;
    const RegionKernels* kernels_;
    std::vector<std::vector<Index>> number_;  ///< per level and node, -1: not in the system
    std::vector<Node> nodes_;                 ///< awake ones first, then ghosts; the last number is what never moves
    std::vector<Ghost> ghosts_;               ///< by level
    std::size_t active_ = 0;
    Part vertices_;                  ///< those that are awake
    Part everything_;                ///< that is awake
    std::vector<RegionEdge> edges_;  ///< springs first
    std::vector<RegionSpring> springs_;
    std::vector<RegionEdge> stiff_edges_;    ///< those that are no springs, with h times their stiffness alone, N s/m
    std::vector<Ghost> pulled_ghosts_;       ///< in whose blocks springs have a part
    std::vector<std::size_t> pulled_nodes_;  ///< likewise, awake
    std::vector<std::uint8_t> is_pulled_;    ///< per node
    std::vector<double> inertia_;            ///< kg, mass + h drag; of awake ones
    std::vector<SymmetricBlock> block_;      ///< of the nodes in whose blocks springs have a part
    std::vector<SymmetricBlock> far_block_;  ///< without these springs
    std::vector<double> inverse_;            ///< 12 a node
    Matrix4X right_side_, whole_right_side_, change_, residual_, preconditioned_, direction_, image_;
    Matrix4X start_change_, start_residual_;  ///< where a search along a direction begins
    Matrix4X place_, speed_;                  ///< m and m/s, of nodes that are no vertices
    std::vector<Row> rows_;
    std::vector<Pressed> pressed_;        ///< in the last step and gave way, by id
    std::vector<std::size_t> moved_;      ///< contacts whose force the direction may change
    std::vector<Vector3> start_;          ///< m/s, as the step begins, of touched vertices
    std::vector<Matrix3> near_block_;     ///< likewise, with what contacts add
    std::vector<Matrix3> loose_inverse_;  ///< of their blocks without contacts
    std::vector<std::size_t> coupled_;    ///< contacts that press on several vertices
    Eigen::MatrixXd coupling_;            ///< of these, its factor
    Eigen::VectorXd coupled_push_;
    Matrix3X left_;  ///< N s, per free piece
    std::vector<double> piece_inertia_;
    // Of the residual with itself, preconditioned, kg m²/s².
    double first_ = 0.0;        ///< the largest that iterations of this step began with
    double acts_ = 0.0;         ///< of the right side, without contacts
    double open_ = 0.0;         ///< as it is, by the blocks without contacts
    double listed_for_ = 0.0;   ///< s
    bool has_changed_ = false;  ///< `change_` is not 0
};

}  // namespace trocar
