// Linearly implicit Euler step (Baraff and Witkin 1998, eq. 6) of all active nodes of a tissue: `A dv = b`, `A = M +
// h (C + D) + h² K`. C holds the dampers, D the drag and K the stiffness of springs (thesis eq. 3.1) and enclosures.
// All are linearised at the start of the step. The transverse part of a spring's K (tension over length) is clamped at
// 0, so that A is always positive definite. Contacts are part of the same system. A pressing contact adds its damper
// and spring to the matrix, so that it feels all others, and hundreds cost few products with it.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tissue/moving_tissue.hpp"
#include "tissue/node_level.hpp"
#include "tissue/system_kernels.hpp"
#include "tissue/tick_contacts.hpp"

namespace trocar {

/// A spring with an active vertex: its entries of SpringArrays, contiguous for the active part.
struct SystemSpring {
    Index i = -1;  ///< vertex of the state
    Index j = -1;
    double k = 0.0;             ///< N/m
    double offset = 0.0;        ///< N
    double damping = 0.0;       ///< N s/m
    double inverse_rest = 0.0;  ///< 1/m; 0 where the rest length is 0
    double sense = 1.0;         ///< 1 where its edge's own node is i, else -1
};

class ImplicitSystem {
public:
    struct Node {
        std::uint32_t level = 0;
        Index node = -1;
    };
    /// How exactly a step is solved.
    struct Accuracy {
        /// The residual is at most this times the contact forces, or a tenth of that times all forces.
        double tolerance = 0.0;
        int iterations = 0;  ///< most of conjugate gradients, for one search
    };

    /// Level 0 holds the vertices of the tissue; of a single level every node is active. All arguments outlive the
    /// object.
    ImplicitSystem(MovingTissue& tissue, std::vector<NodeLevel>& levels);

    /// Lists the active nodes for steps of h (s). Call it before the first step, and where nodes became active or
    /// interpolated or h changed.
    void list(double h);
    /// Step that the nodes are listed for, s; 0: none.
    [[nodiscard]] double listed_for() const { return listed_for_; }
    /// Interpolated nodes next to active ones, by level. Their positions and velocities enter `linearise`.
    [[nodiscard]] std::span<const Node> interpolated() const { return std::span(nodes_).subspan(active_); }
    /// Linearises the active nodes at the state of the tissue and the levels.
    void linearise();
    /// Computes the change of all velocities and the force of every contact, for one of `steps` equal steps of a tick.
    /// `known`: the normal forces are prescribed by `held`.
    void solve(bool known, int steps, const Accuracy& accuracy, TickContacts& contacts);
    /// Moves the active nodes by their new velocities. Returns the largest displacement of a coordinate, m; not finite
    /// if a number is not.
    double move();
    /// Discards the contact forces of the last step as initial guess.
    void forget() { pressed_.clear(); }

    /// Springs with an active vertex.
    [[nodiscard]] std::span<const SystemSpring> springs() const { return springs_; }

private:
    /// An interpolated node next to an active one; it moves with its parents.
    struct Ghost {
        std::size_t number = 0;
        std::array<std::size_t, 3> parent{};
        std::array<double, 3> weight{};
    };
    /// A contact in the matrix.
    struct Row {
        /// N, on P along the normal, if the step ends with this rate (m/s).
        [[nodiscard]] double force(double after) const { return std::clamp(given - yield * after, least, most); }
        /// True if that force depends on the rate.
        [[nodiscard]] bool yields(double after) const {
            const double wanted = given - yield * after;
            return yield > 0.0 && wanted > least && wanted < most;
        }
        [[nodiscard]] bool yields() const { return yields(rate); }
        /// kg, its contribution along the normal to the matrix of a step of h (s).
        [[nodiscard]] double pressing(double h) const { return yields() ? h * yield : 0.0; }
        /// Component of a vector along the surface and perpendicular to the direction of sliding.
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
        double rate = 0.0;         ///< m/s, at the current change
        double along = 0.0;        ///< m/s, its change per unit step along the direction
        double start_rate = 0.0;   ///< m/s, at the start of a line search
        double start_force = 0.0;  ///< N, at `start_rate`
        double now = 0.0;          ///< N, at `rate`
        double press = 0.0;        ///< kg, along the normal, in the preconditioner and in `descend`
        bool couples = false;      ///< acts on several vertices and is part of `couple`
        double square = 0.0;       ///< kg m²/s² per N², of its force in the residual norm without contacts
        // The tangential force is -stretched - slope held(speed after the step).
        bool has_friction = false;
        double slope = 0.0;                   ///< N s/m
        Vector3 stretched = Vector3::Zero();  ///< N
        Vector3 slide = Vector3::Zero();      ///< unit direction of sliding; zero while it sticks
    };
    struct Pressed {
        std::uint64_t id = 0;  ///< of the contact
        double force = 0.0;    ///< N
    };
    struct Descent {
        int iterations = 0;
        bool strays = false;  ///< a contact left its assumed state
    };
    /// The first `nodes` active nodes, and the first `edges` edges with an end among them.
    struct Part {
        std::size_t nodes = 0;
        std::size_t edges = 0;
    };
    static constexpr std::size_t most_coupled = 256;  ///< factoring a larger matrix takes longer than a tick
    void sort_blocks();
    Index number_of(std::size_t level, Index node);
    void invert(std::size_t node, const Matrix3& block);
    void prolongate(Matrix4X& vector) const;
    void restrict_to_coarse(Matrix4X& vector) const;
    void take_enclosures(Matrix4X& right);
    void add_enclosures(const Matrix4X& vector, Matrix4X& product) const;
    void multiply(const Part& part, const TickContacts& contacts);
    double precondition(double by, const Part& part, const TickContacts& contacts);
    void couple(const TickContacts& contacts);
    [[nodiscard]] double step_length(double h, double downhill, double curvature) const;
    void find_change(double h, const Part& part, const Accuracy& accuracy, TickContacts& contacts);
    void stand_still();
    void begin_as_before(double h, TickContacts& contacts);
    void remember_forces(const TickContacts& contacts);
    void take_residual(double h, const Part& part, const TickContacts& contacts);
    Descent descend(const Part& part, double rho, const Accuracy& accuracy, const TickContacts& contacts);
    void go_along(double h, const Part& part, const TickContacts& contacts);
    [[nodiscard]] bool is_settled(double rho, double tolerance) const;
    void close_momentum();
    [[nodiscard]] static double tangent_slope(double h, const TickContact& contact, const TickContacts& contacts);
    void stick(double h, std::size_t c, TickContacts& contacts);
    void slide(double h, std::size_t c, double most, const Vector3& pull, TickContacts& contacts);
    void take_laws(double h, bool known, TickContacts& contacts);
    /// Entry of a contact that gave way in the last step, or nullptr.
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
    /// Adds an impulse (N s) of a contact along its normal to a vector of its vertices.
    void push(const TickContact& contact, double impulse, Matrix4X& vector) const {
        each_end(contact,
                 [&](Eigen::Index n, double weight) { vector.col(n).head<3>() += weight * impulse * contact.normal; });
    }
    /// Component of a vector at P along the contact's normal.
    [[nodiscard]] double along(const TickContact& contact, const Matrix4X& vector) const {
        double sum = 0.0;
        each_end(contact,
                 [&](Eigen::Index n, double weight) { sum += weight * vector.col(n).head<3>().dot(contact.normal); });
        return sum;
    }

    MovingTissue* tissue_;
    std::vector<NodeLevel>* levels_;
    const SystemKernels* kernels_;
    std::vector<std::vector<Index>> number_;  ///< per level and node; -1: not in the system
    std::vector<Node> nodes_;    ///< active ones first, then ghosts; number nodes_.size() stands for fixed nodes
    std::vector<Ghost> ghosts_;  ///< by level
    std::size_t active_ = 0;
    Part vertices_;                  ///< active vertices
    Part everything_;                ///< all active nodes
    std::vector<SystemEdge> edges_;  ///< springs first
    std::vector<SystemSpring> springs_;
    std::vector<SystemEdge> stiff_edges_;    ///< edges above level 0 with h times their stiffness alone, N s/m
    std::vector<Ghost> pulled_ghosts_;       ///< ghosts with springs in their blocks
    std::vector<std::size_t> pulled_nodes_;  ///< active nodes with springs in their blocks
    std::vector<std::uint8_t> is_pulled_;    ///< per node
    std::vector<double> inertia_;            ///< kg, mass + h drag; per active node
    std::vector<SymmetricBlock> block_;      ///< of nodes with springs in their blocks
    std::vector<SymmetricBlock> far_block_;  ///< without springs
    std::vector<double> inverse_;            ///< 12 per node
    Matrix4X right_side_, whole_right_side_, change_, residual_, preconditioned_, direction_, image_;
    Matrix4X start_change_, start_residual_;  ///< at the start of a line search
    Matrix4X place_, speed_;                  ///< m and m/s, of nodes above level 0
    std::vector<Row> rows_;
    std::vector<Pressed> pressed_;        ///< contacts that gave way in the last step, by id
    std::vector<std::size_t> moved_;      ///< contacts whose rate changes along the direction
    std::vector<Vector3> start_;          ///< m/s, of touched vertices at the start of the step
    std::vector<Matrix3> near_block_;     ///< blocks of touched vertices with contacts
    std::vector<Matrix3> loose_inverse_;  ///< inverse blocks of touched vertices without contacts
    std::vector<std::size_t> coupled_;    ///< coupled contacts that press
    Eigen::MatrixXd coupling_;            ///< their Cholesky factor
    Eigen::VectorXd coupled_push_;
    Matrix3X left_;  ///< N s, residual per free piece
    std::vector<double> piece_inertia_;
    // Squared norms by the preconditioner, kg m²/s².
    double first_ = 0.0;        ///< largest first residual of the iterations of this step
    double acts_ = 0.0;         ///< of the right side without contacts
    double open_ = 0.0;         ///< current residual, by blocks without contacts
    double listed_for_ = 0.0;   ///< s
    bool has_changed_ = false;  ///< `change_` is not 0
    bool is_finite_ = true;     ///< of the numbers of this step
};

}  // namespace trocar
