#include "reference/implicit_solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "reference/block_matrix.hpp"
#include "reference/elastic_foundation.hpp"
#include "reference/hard_contact.hpp"

namespace trocar {
namespace {

constexpr double tolerance = 1e-6;  ///< relative to the largest contact force, at least to the typical one
constexpr int most_iterations = 400;
/// Weight with which a step is held to the end of the script's path, J: 1e6 times the work of a contact over a step.
constexpr double path_weight = 1e3;

struct Operator {
    Index body = -1;  ///< the first of its instrument, whose script it follows
    Index node = -1;
    OperatorModel model;
    Vector3 target = Vector3::Zero();
    Vector3 target_velocity = Vector3::Zero();
};

}  // namespace

struct ImplicitSolver::State {
    const Scene& scene;
    const Topology& topology;
    const Materials& materials;
    SolverSettings settings;

    // Unknowns: one node of three for each free tissue vertex and each operator, and how far the script has come.
    std::vector<Index> node_of_vertex;    ///< N, -1 = not free
    std::vector<Index> vertex_of_node;    ///< -1 = operator
    std::vector<Index> operator_of_body;  ///< position in operators, -1 = none
    std::vector<Operator> operators;
    Matrix3X x;       ///< 3×N, now
    Matrix3X script;  ///< 3×N, how far the script moves a vertex in this step
    double progress = 1.0;
    Matrix3X node;                                      ///< 3×nodes, place of each node now
    Matrix3X node_before, node_rate, node_rate_before;  ///< last but one place; velocity last and last but one
    Matrix3X node_start;                                ///< place at the start of the step
    Matrix3X coast, coast_rate;                         ///< BDF2: v = alpha (node - coast), a = alpha (v - coast_rate)
    double alpha = 0.0;
    std::vector<double> node_mass, node_drag;
    std::vector<Vector3> spring_direction;
    double time = 0.0;
    bool script_moves = false;

    std::vector<std::uint8_t> body_moves;  ///< tissue or operator
    std::vector<std::array<Index, 2>> contact_bodies;
    std::optional<HardContact> hard;
    ElasticFoundation foundation;

    std::vector<ContactTerm> terms;
    BlockMatrix matrix;
    Eigen::VectorXd gradient, direction;
    double last_residual = 0.0;
    double last_contact = 0.0;
    double last_gap = std::numeric_limits<double>::infinity();
    int last_iterations = 0;
    std::string text;

    State(const Scene& the_scene, const SolverSettings& the_settings)
        : scene(the_scene), topology(the_scene.topology), materials(the_scene.materials), settings(the_settings) {
        operator_of_body = operators_of_bodies(scene);
        x = scene.first.position;
        script = Matrix3X::Zero(3, topology.vertex_count);
        find_nodes();
        if (settings.law == ReferenceLaw::foundation) {
            foundation = ElasticFoundation(scene, contact_bodies, settings.foundation_points, x);
        } else {
            std::vector<std::uint8_t> moves;
            moves.reserve(node_of_vertex.size());
            for (const Index n : node_of_vertex) moves.push_back(n >= 0 ? 1 : 0);
            hard.emplace(topology, contact_bodies, moves, settings.rest_gap);
        }
        const auto nodes = static_cast<Index>(vertex_of_node.size());
        matrix.prepare(nodes);
        for (const Spring& spring : materials.springs) {
            const Index i = node_of_vertex[at(spring.i)];
            const Index j = node_of_vertex[at(spring.j)];
            if (i >= 0 && j >= 0) matrix.reserve(i, j);
        }
        spring_direction.resize(materials.springs.size());
        gradient.resize(3 * nodes + 1);
        node_before = node;
        node_rate = Matrix3X::Zero(3, nodes);
        node_rate_before = node_rate;
    }

    void find_nodes() {
        node_of_vertex.assign(at(topology.vertex_count), -1);
        body_moves.assign(topology.bodies.size(), 0);
        std::vector<Vector3> places;
        for (std::size_t b = 0; b < topology.bodies.size(); ++b) {
            const BodyRange& body = topology.bodies[b];
            if (body.kind != BodyKind::tissue) continue;
            body_moves[b] = 1;
            for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
                if (!materials.is_free(v)) continue;
                node_of_vertex[at(v)] = static_cast<Index>(vertex_of_node.size());
                vertex_of_node.push_back(v);
                node_mass.push_back(materials.mass[at(v)]);
                node_drag.push_back(materials.drag[at(v)]);
                places.emplace_back(x.col(v));
            }
        }
        for (Index b = 0; b < topology.body_count(); ++b) {
            const Index number = operator_of_body[at(b)];
            if (number < 0) continue;
            const auto& motion = scene.bodies[at(b)].motion;
            if (at(number) == operators.size()) {
                operators.push_back(
                    {.body = b, .node = static_cast<Index>(vertex_of_node.size()), .model = motion->coupling});
                vertex_of_node.push_back(-1);
                node_mass.push_back(motion->coupling.mass);
                node_drag.push_back(0.0);
                places.push_back(motion->pose_at(0.0).translation);
            }
            body_moves[at(b)] = 1;
            const Range body = topology.bodies[at(b)].vertices;
            for (Index v = body.first; v < body.end(); ++v) node_of_vertex[at(v)] = operators[at(number)].node;
        }
        node.resize(3, static_cast<Eigen::Index>(places.size()));
        for (std::size_t n = 0; n < places.size(); ++n) node.col(static_cast<Eigen::Index>(n)) = places[n];
        for (const auto& [a, b] : topology.body_pairs) {
            if (body_moves[at(a)] != 0 || body_moves[at(b)] != 0) contact_bodies.push_back({a, b});
        }
    }

    // ------------------------------------------------------------ potential
    /// Springs, bias, inertia and damping; adds to gradient and matrix when asked.
    double smooth_part(bool derivatives) {
        double value = 0.0;
        const auto push = [&](Index n, const Vector3& g) { gradient.segment<3>(3 * n) += g; };
        const double damping_scale = settings.quasi_static ? 0.0 : alpha;
        for (std::size_t s = 0; s < materials.springs.size(); ++s) {
            const Spring& spring = materials.springs[s];
            const Index i = node_of_vertex[at(spring.i)];
            const Index j = node_of_vertex[at(spring.j)];
            if (i < 0 && j < 0) continue;
            const Vector3 d = x.col(spring.j) - x.col(spring.i);
            const double length = d.norm();
            const double stretch = length - spring.rest;
            value += 0.5 * spring.k * stretch * stretch + spring.preload * stretch;
            const Vector3& u0 = spring_direction[s];
            double closing = 0.0;
            if (damping_scale > 0.0) {
                if (j >= 0) closing += (node.col(j) - coast.col(j)).dot(u0);
                if (i >= 0) closing -= (node.col(i) - coast.col(i)).dot(u0);
                value += 0.5 * damping_scale * spring.damping * closing * closing;
            }
            if (!derivatives) continue;
            const double tension = spring.k * stretch + spring.preload;
            const Vector3 u = length > 0.0 ? Vector3(d / length) : Vector3::Zero();
            const Vector3 g = tension * u + damping_scale * spring.damping * closing * u0;
            const Matrix3 along = u * u.transpose();
            // A slack spring would be unstable across its direction; without it Newton's matrix stays definite.
            Matrix3 h = spring.k * along + damping_scale * spring.damping * (u0 * u0.transpose());
            if (length > 0.0) h += std::max(tension, 0.0) / length * (Matrix3::Identity() - along);
            if (i >= 0) {
                push(i, -g);
                matrix.add(i, i, h);
            }
            if (j >= 0) {
                push(j, g);
                matrix.add(j, j, h);
            }
            if (i >= 0 && j >= 0) matrix.add(i, j, -h);
        }
        for (Index n = 0; n < node.cols(); ++n) {
            const Index v = vertex_of_node[at(n)];
            if (v >= 0) {
                value -= materials.rest_bias.col(v).dot(node.col(n));
                if (derivatives) push(n, -materials.rest_bias.col(v));
            }
            if (settings.quasi_static) {
                // Keeps directions without stiffness definite; it is in the matrix only.
                if (derivatives) matrix.add(n, n, 1e-4 * Matrix3::Identity());
                continue;
            }
            const Vector3 moved = node.col(n) - coast.col(n);
            const Vector3 rate_change = alpha * moved - coast_rate.col(n);
            const double mass = node_mass[at(n)];
            const double drag = node_drag[at(n)];
            value += 0.5 * mass * rate_change.squaredNorm() + 0.5 * drag * alpha * moved.squaredNorm();
            if (!derivatives) continue;
            push(n, alpha * mass * rate_change + drag * alpha * moved);
            matrix.add(n, n, (alpha * alpha * mass + alpha * drag) * Matrix3::Identity());
        }
        for (const Operator& coupling : operators) {
            const OperatorModel& model = coupling.model;
            const Vector3 off = node.col(coupling.node) - coupling.target;
            value += 0.5 * model.coupling_stiffness * off.squaredNorm();
            Vector3 g = model.coupling_stiffness * off;
            double stiffness = model.coupling_stiffness;
            if (!settings.quasi_static) {
                const Vector3 rate = alpha * (node.col(coupling.node) - coast.col(coupling.node));
                const Vector3 relative = rate - coupling.target_velocity;
                value += 0.5 / alpha *
                         (model.coupling_damping * relative.squaredNorm() + model.damping * rate.squaredNorm());
                g += model.coupling_damping * relative + model.damping * rate;
                stiffness += alpha * (model.coupling_damping + model.damping);
            }
            if (!derivatives) continue;
            push(coupling.node, g);
            matrix.add(coupling.node, coupling.node, stiffness * Matrix3::Identity());
        }
        const double left = 1.0 - progress;
        value += 0.5 * path_weight * left * left;
        if (derivatives) {
            gradient[gradient.size() - 1] -= path_weight * left;
            matrix.add_last(path_weight);
        }
        return value;
    }

    /// Contact energies; fills `terms` when derivatives are asked.
    double contact_part(bool derivatives) {
        terms.clear();
        std::vector<ContactTerm>* const wanted = derivatives ? &terms : nullptr;
        if (hard) return hard->energy(x, wanted, last_gap);
        return foundation.energy(x, settings.quasi_static ? 0.0 : settings.time_step, wanted, last_gap);
    }

    void add_terms() {
        for (const ContactTerm& term : terms) {
            double along_script = 0.0;
            for (int i = 0; i < term.count; ++i) {
                const Vector3& g = term.gradient.at(static_cast<std::size_t>(i));
                const Index v = term.vertex.at(static_cast<std::size_t>(i));
                const Index n = node_of_vertex[at(v)];
                along_script += g.dot(script.col(v));
                if (n >= 0) gradient.segment<3>(3 * n) += term.slope * g;
            }
            gradient[gradient.size() - 1] += term.slope * along_script;
            matrix.add_last(term.curvature * along_script * along_script);
            // Vertices of one operator share a node: gradients are summed per node first.
            std::array<Index, 6> nodes{};
            std::array<Vector3, 6> sums{};
            std::size_t count = 0;
            for (int i = 0; i < term.count; ++i) {
                const Index n = node_of_vertex[at(term.vertex.at(static_cast<std::size_t>(i)))];
                if (n < 0) continue;
                std::size_t place = 0;
                while (place < count && nodes.at(place) != n) ++place;
                if (place == count) {
                    nodes.at(count) = n;
                    sums.at(count++) = Vector3::Zero();
                }
                sums.at(place) += term.gradient.at(static_cast<std::size_t>(i));
            }
            for (std::size_t i = 0; i < count; ++i) {
                for (std::size_t j = 0; j <= i; ++j) {
                    matrix.add(nodes.at(i), nodes.at(j), term.curvature * sums.at(i) * sums.at(j).transpose());
                }
                matrix.add_last_row(nodes.at(i), term.curvature * along_script * sums.at(i));
            }
        }
    }

    void reserve_terms() {
        for (const ContactTerm& term : terms) {
            for (int i = 0; i < term.count; ++i) {
                const Index a = node_of_vertex[at(term.vertex.at(static_cast<std::size_t>(i)))];
                for (int j = 0; a >= 0 && j < i; ++j) {
                    const Index b = node_of_vertex[at(term.vertex.at(static_cast<std::size_t>(j)))];
                    if (b >= 0) matrix.reserve(a, b);
                }
            }
        }
    }

    double potential() { return smooth_part(false) + contact_part(false); }

    double derive() {
        const double contact = contact_part(true);
        reserve_terms();
        matrix.clear();
        gradient.setZero();
        const double value = contact + smooth_part(true);
        add_terms();
        return value;
    }

    // ------------------------------------------------------------ one step
    void move_by(double part) {
        const Index last = static_cast<Index>(direction.size()) - 1;
        const double along = part * direction[last];
        progress += along;
        for (Index n = 0; n < node.cols(); ++n) node.col(n) += part * direction.segment<3>(3 * n);
        for (Index v = 0; v < topology.vertex_count; ++v) {
            const Index n = node_of_vertex[at(v)];
            if (n >= 0) x.col(v) += part * direction.segment<3>(3 * n);
            if (script_moves) x.col(v) += along * script.col(v);
        }
    }

    void motion_of_direction(Matrix3X& motion) const {
        const double along = direction[direction.size() - 1];
        motion = along * script;
        for (Index v = 0; v < topology.vertex_count; ++v) {
            const Index n = node_of_vertex[at(v)];
            if (n >= 0) motion.col(v) += direction.segment<3>(3 * n);
        }
    }

    /// Where the script drives all that is not free in this step, and what the operators want.
    void read_script(double target_time) {
        Matrix3X target = x;
        for (Index b = 0; b < topology.body_count(); ++b) {
            const auto& motion = scene.bodies[at(b)].motion;
            if (!motion) continue;
            Pose pose = motion->pose_at(target_time);
            if (motion->drive == Drive::simulated_operator) {
                Operator& coupling = operators[at(operator_of_body[at(b)])];
                if (coupling.body == b) {
                    const Vector3 before = motion->pose_at(target_time - settings.time_step).translation;
                    coupling.target = pose.translation;
                    coupling.target_velocity = (pose.translation - before) / settings.time_step;
                }
                pose.translation += node.col(coupling.node) - coupling.target;
            }
            place_body(scene.bodies[at(b)], topology.bodies[at(b)].vertices, pose, target);
        }
        script = target - x;
        // Free vertices go where the solution puts them; an operator's body is turned by its script.
        for (Index v = 0; v < topology.vertex_count; ++v) {
            const Index n = node_of_vertex[at(v)];
            if (n >= 0 && vertex_of_node[at(n)] >= 0) script.col(v).setZero();
        }
        script_moves = script.cwiseAbs().maxCoeff() > 0.0;
    }

    /// Whether the script may bend in [from, to).
    bool script_has_key(double from, double to) const {
        constexpr double rounding = 1e-9;  // s
        for (const SceneBody& body : scene.bodies) {
            if (!body.motion) continue;
            for (const MotionKey& key : body.motion->keys) {
                if (key.time >= from - rounding && key.time < to - rounding) return true;
            }
        }
        return false;
    }

    bool step() {
        const Matrix3X x_before_step = x;
        const double h = settings.time_step;
        node_start = node;
        read_script(time + h);
        progress = script_moves ? 0.0 : 1.0;
        // BDF2 takes the path so far for smooth; where it is not (the start, a key of the script) it would shift all
        // that follows by half a step, so that step is one of backward Euler, whose error happens once.
        const bool anew = time == 0.0 || script_has_key(time, time + h);
        alpha = anew ? 1.0 / h : 1.5 / h;
        coast = anew ? node : Matrix3X((4.0 * node - node_before) / 3.0);
        coast_rate = anew ? node_rate : Matrix3X((4.0 * node_rate - node_rate_before) / 3.0);
        const Matrix3X ahead = anew ? Matrix3X(node + h * node_rate) : Matrix3X(2.0 * node - node_before);
        for (std::size_t s = 0; s < materials.springs.size(); ++s) {
            const auto place = [&](Index v) {
                const Index n = node_of_vertex[at(v)];
                return n >= 0 ? Vector3(ahead.col(n)) : Vector3(x.col(v));
            };
            spring_direction[s] = (place(materials.springs[s].j) - place(materials.springs[s].i)).normalized();
        }
        if (!hard) {
            // Nothing holds the script back: bodies are where it puts them.
            x += script;
            script.setZero();
            script_moves = false;
            progress = 1.0;
        }
        if (!solve()) {
            x = x_before_step;
            node = node_start;
            return false;
        }
        node_before = node_start;
        node_rate_before = node_rate;
        node_rate = alpha * (node - coast);
        if (!hard && !foundation.remember_depths(x)) {
            return fail("the foundation is passed through: the shortest way out is no longer the way in");
        }
        time += h;
        return true;
    }

    /// Unbalanced force of the current gradient, and how large contacts are.
    void measure_residual() {
        last_residual = 0.0;
        for (Index n = 0; n < node.cols(); ++n) {
            last_residual = std::max(last_residual, gradient.segment<3>(3 * n).norm());
        }
        last_contact = 0.0;
        for (const ContactTerm& term : terms) last_contact = std::max(last_contact, std::abs(term.slope));
    }

    bool solve() {
        Matrix3X motion = Matrix3X::Zero(3, topology.vertex_count);
        if (hard) {
            // Where nothing obstructs them, bodies go where the script puts them at once.
            hard->begin_step(x);
            hard->find_candidates(x, script);
            if (hard->empty() && script_moves) {
                x += script;
                script.setZero();
                script_moves = false;
                progress = 1.0;
                hard->begin_step(x);
            }
            hard->find_candidates(x, motion);
        }
        for (int iteration = 0; iteration < most_iterations; ++iteration) {
            last_iterations = iteration;
            const double value = derive();
            measure_residual();
            const double allowed = tolerance * std::max(typical_contact, last_contact);
            if (last_residual <= allowed && 1.0 - progress <= 1e-3) return true;
            if (!std::isfinite(value)) return fail("the potential is not finite");
            if (!matrix.solve(-gradient, direction)) return fail("the stiffness matrix is not positive definite");
            motion_of_direction(motion);
            double part = 1.0;
            if (hard) {
                // No vertex leaves the neighbourhood in which its candidates are few.
                const double longest = motion.colwise().norm().maxCoeff();
                constexpr double most_motion = 0.005;
                if (longest > most_motion) {
                    motion *= most_motion / longest;
                    direction *= most_motion / longest;
                }
                hard->find_candidates(x, motion);
                part = hard->safe_part(x, motion);
            }
            const double slope = gradient.dot(direction);
            const bool close = last_residual <= 100.0 * allowed && 1.0 - progress <= 1e-3;
            if (!line_search(value, slope, part)) {
                // Rounding hides what is left to gain: as good as it gets.
                if (close) return true;
                return fail(fmt::format("no descent at a residual of {:.2e} N", last_residual));
            }
            // On a ridge, such as a point on a corner, it creeps for ever: the balance there is one all the same.
            if (close && iteration + 1 == most_iterations) return true;
        }
        return fail(fmt::format("no convergence within {} iterations, residual {:.2e} N, script at {:.3f} of its step",
                                most_iterations, last_residual, progress));
    }

    bool line_search(double value, double slope, double part) {
        const Matrix3X x_start = x;
        const Matrix3X node_here = node;
        const double progress_start = progress;
        constexpr int most_halvings = 40;
        for (int halving = 0; halving < most_halvings; ++halving) {
            move_by(part);
            const double now = potential();
            const double noise = 1e-13 * std::abs(value);
            if (now <= value + 1e-4 * part * slope + noise) return true;
            x = x_start;
            node = node_here;
            progress = progress_start;
            part *= 0.5;
        }
        return false;
    }

    bool fail(const std::string& what) {
        text = fmt::format("at {:.4f} s: {}", time + settings.time_step, what);
        return false;
    }
};

ImplicitSolver::ImplicitSolver(const Scene& scene, const SolverSettings& settings)
    : state_(std::make_unique<State>(scene, settings)) {}
ImplicitSolver::~ImplicitSolver() = default;

bool ImplicitSolver::step() { return state_->step(); }
double ImplicitSolver::time() const { return state_->time; }
const Matrix3X& ImplicitSolver::position() const { return state_->x; }
double ImplicitSolver::residual() const { return state_->last_residual; }
double ImplicitSolver::largest_contact() const { return state_->last_contact; }
double ImplicitSolver::smallest_gap() const { return state_->last_gap; }
const std::string& ImplicitSolver::message() const { return state_->text; }
int ImplicitSolver::iterations() const { return state_->last_iterations; }

Vector3 ImplicitSolver::force_on(Index body) const {
    const Range range = state_->topology.bodies[at(body)].vertices;
    return contact_forces().middleCols(range.first, range.count).rowwise().sum();
}

Matrix3X ImplicitSolver::contact_forces() const {
    Matrix3X force = Matrix3X::Zero(3, state_->topology.vertex_count);
    for (const ContactTerm& term : state_->terms) {
        for (int i = 0; i < term.count; ++i) {
            force.col(term.vertex.at(static_cast<std::size_t>(i))) -=
                term.slope * term.gradient.at(static_cast<std::size_t>(i));
        }
    }
    return force;
}

double ImplicitSolver::max_strain() const {
    double strain = 0.0;
    for (const Spring& spring : state_->materials.springs) {
        if (spring.rest <= 0.0) continue;
        strain = std::max(strain, (state_->x.col(spring.j) - state_->x.col(spring.i)).norm() / spring.rest - 1.0);
    }
    return strain;
}

Vector3 ImplicitSolver::pin_force() const {
    Vector3 sum = Vector3::Zero();
    for (const Spring& spring : state_->materials.springs) {
        const Vector3 d = state_->x.col(spring.j) - state_->x.col(spring.i);
        const double length = d.norm();
        if (length == 0.0) continue;
        const Vector3 pull = (spring.k * (length - spring.rest) + spring.preload) / length * d;
        if (state_->node_of_vertex[at(spring.i)] < 0) sum += pull;
        if (state_->node_of_vertex[at(spring.j)] < 0) sum -= pull;
    }
    return sum;
}

}  // namespace trocar
