#include "reference/implicit_solver.hpp"

#include <fmt/format.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "geometry/box_pairs.hpp"
#include "reference/signed_distance.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

constexpr double kappa_default = 3e6;  ///< N/m³, METHODS §12
constexpr double k_default = 1000.0;   ///< N/m, between bodies that do not deform
constexpr double open_reach = 0.01;    ///< m, points up to this far beyond an open sheet count
constexpr double mu_default = 2.0;     ///< N s/m
/// Force at which surfaces stand about half the rest gap apart, N: the size of forces in such scenes.
constexpr double typical_contact = 0.05;
constexpr double tolerance = 1e-6;  ///< relative to the largest contact force, at least to the typical one
constexpr int most_iterations = 400;
constexpr int patience = 100;  ///< iterations after which a hundredfold residual is taken
/// Weight with which a step is held to the end of the script's path, J: 1e6 times the work of a contact over a step.
constexpr double path_weight = 1e3;

struct Barrier {
    double value = 0.0;
    double slope = 0.0;
    double curvature = 0.0;
};
/// b(d) = -(kappa) (g - d)² ln(d / g) for d < g, else 0.
Barrier barrier(double d, double g) {
    Barrier result;
    if (d >= g) return result;
    const double kappa = typical_contact / g;
    const double log = std::log(d / g);
    const double rest = g - d;
    result.value = -kappa * rest * rest * log;
    result.slope = kappa * (2.0 * rest * log - rest * rest / d);
    result.curvature = kappa * (-2.0 * log + 4.0 * rest / d + rest * rest / (d * d));
    return result;
}

/// Sparse symmetric matrix of 3×3 blocks plus one last scalar row, whose pattern is kept from step to step.
class BlockMatrix {
public:
    void prepare(Index nodes) {
        rows_.assign(at(nodes), {});
        for (Index n = 0; n < nodes; ++n) rows_[at(n)].push_back(n);
        dirty_ = true;
    }
    /// Makes room for the block of two nodes.
    void reserve(Index a, Index b) {
        const Index column = std::min(a, b);
        const Index row = std::max(a, b);
        auto& list = rows_[at(column)];
        const auto found = std::lower_bound(list.begin(), list.end(), row);
        if (found != list.end() && *found == row) return;
        list.insert(found, row);
        dirty_ = true;
    }
    void clear() {
        if (dirty_) build();
        std::fill_n(matrix_.valuePtr(), matrix_.nonZeros(), 0.0);
    }
    /// Adds `block` at (a, b); only the lower triangle is kept, so of two different nodes it is called once.
    void add(Index a, Index b, const Matrix3& block) {
        const Index column = std::min(a, b);
        const Index row = std::max(a, b);
        const auto& list = rows_[at(column)];
        const auto place = std::lower_bound(list.begin(), list.end(), row) - list.begin();
        for (int c = 0; c < 3; ++c) {
            double* const values = matrix_.valuePtr() + matrix_.outerIndexPtr()[3 * column + c] + 3 * place;
            for (int r = 0; r < 3; ++r) values[r] += a >= b ? block(r, c) : block(c, r);
        }
    }
    void add_last_row(Index node, const Vector3& row) {
        for (int c = 0; c < 3; ++c) matrix_.valuePtr()[matrix_.outerIndexPtr()[3 * node + c + 1] - 1] += row[c];
    }
    void add_last(double value) { matrix_.valuePtr()[matrix_.nonZeros() - 1] += value; }
    /// Solves; false when the matrix is not positive definite. Neighbouring steps have similar matrices: conjugate
    /// gradients with the last factors come first, new factors where those do not fit any more.
    bool solve(const Eigen::VectorXd& right_side, Eigen::VectorXd& solution) {
        if (factors_ && solve_by_gradients(right_side, solution)) return true;
        if (!analyzed_) solver_.analyzePattern(matrix_);
        analyzed_ = true;
        solver_.factorize(matrix_);
        factors_ = solver_.info() == Eigen::Success && solver_.vectorD().minCoeff() > 0.0;
        if (!factors_) return false;
        solution = solver_.solve(right_side);
        return solution.allFinite();
    }

private:
    bool solve_by_gradients(const Eigen::VectorXd& right_side, Eigen::VectorXd& solution) {
        constexpr int most_gradients = 16;  // about the time of new factors
        constexpr double forcing = 1e-4;    // relative, in the norm of the factors' inverse
        solution.setZero(right_side.size());
        rest_ = right_side;
        conditioned_ = solver_.solve(rest_);
        along_ = conditioned_;
        double square = rest_.dot(conditioned_);
        const double enough = forcing * forcing * square;
        for (int i = 0; i < most_gradients; ++i) {
            image_.noalias() = matrix_.selfadjointView<Eigen::Lower>() * along_;
            const double curvature = along_.dot(image_);
            if (!(curvature > 0.0) || !std::isfinite(curvature)) return false;
            const double length = square / curvature;
            solution += length * along_;
            rest_ -= length * image_;
            conditioned_ = solver_.solve(rest_);
            const double next = rest_.dot(conditioned_);
            if (next <= enough) return solution.allFinite();
            along_ = conditioned_ + next / square * along_;
            square = next;
        }
        return false;
    }
    void build() {
        const auto nodes = static_cast<Index>(rows_.size());
        const Index size = 3 * nodes + 1;
        matrix_.resize(size, size);
        Eigen::VectorXi count(size);
        for (Index n = 0; n < nodes; ++n)
            count.segment<3>(3 * n).setConstant(static_cast<int>(3 * rows_[at(n)].size() + 1));
        count[size - 1] = 1;
        matrix_.reserve(count);
        for (Index n = 0; n < nodes; ++n) {
            for (int c = 0; c < 3; ++c) {
                for (const Index row : rows_[at(n)]) {
                    for (int r = 0; r < 3; ++r) matrix_.insert(3 * row + r, 3 * n + c) = 0.0;
                }
                matrix_.insert(size - 1, 3 * n + c) = 0.0;
            }
        }
        matrix_.insert(size - 1, size - 1) = 0.0;
        matrix_.makeCompressed();
        dirty_ = false;
        analyzed_ = false;
    }
    std::vector<std::vector<Index>> rows_;  ///< per node: nodes >= it that it is coupled with, ascending
    Eigen::SparseMatrix<double> matrix_;
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver_;
    Eigen::VectorXd rest_, conditioned_, along_, image_;
    bool dirty_ = true;
    bool analyzed_ = false;
    bool factors_ = false;  ///< solver_ holds factors of some earlier matrix
};

/// A contact's part in potential, gradient and stiffness: energy e(d) of a scalar d with ∂d/∂x_i = gradient_i.
struct Term {
    int count = 0;
    std::array<Index, 6> vertex{};
    std::array<Vector3, 6> gradient{};
    double slope = 0.0;      ///< e'(d), N
    double curvature = 0.0;  ///< e''(d), N/m
};

/// One surface's area sampled against another body.
struct Foundation {
    Index slave = -1;
    Index master = -1;
    double kappa = 0.0;                ///< N/m³
    double eta = 0.0;                  ///< N s/m³
    std::vector<Vector3> weights;      ///< of the sample points of one triangle, in its corners
    std::vector<double> area;          ///< m², rest area of the slave's triangles
    std::vector<double> depth_before;  ///< per triangle and point, >= 0
    double side = 1.0;                 ///< of an open sheet on which the slave starts: +1 front, -1 back
    double most_depth = 0.0;           ///< m, beyond it the shortest way out is no longer the way in
    // Samples that were outside by more than all vertices have moved since need not be looked at.
    std::vector<double> clearance;  ///< m, per triangle and point
    Matrix3X looked_from;           ///< 3×N, positions of that look
};

struct Hand {
    std::vector<Index> bodies;
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
    std::vector<Index> node_of_vertex;  ///< N, -1 = not free
    std::vector<Index> vertex_of_node;  ///< -1 = operator
    std::vector<Hand> hands;
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
    std::vector<Index> first_triangle_of_vertex;
    std::vector<std::array<Index, 2>> edges;
    std::vector<Index> first_triangle_of_edge;
    std::vector<std::array<Index, 3>> edges_of_triangle;
    std::vector<Foundation> foundations;
    std::vector<SignedDistance> masters;  ///< per body, prepared when it is one

    std::vector<FeaturePair> candidates;
    std::vector<double> candidate_weight;  ///< 0 … 1, edges that are nearly parallel fade
    std::vector<Box> boxes;
    std::vector<IndexPair> box_pairs;
    std::vector<Term> terms;
    BlockMatrix matrix;
    Eigen::VectorXd gradient, direction;
    double last_residual = 0.0;
    double last_contact = 0.0;
    double last_gap = std::numeric_limits<double>::infinity();
    int last_iterations = 0;
    std::string text;

    State(const Scene& the_scene, const SolverSettings& the_settings)
        : scene(the_scene), topology(the_scene.topology), materials(the_scene.materials), settings(the_settings) {
        x = scene.first.position;
        script = Matrix3X::Zero(3, topology.vertex_count);
        find_nodes();
        find_features();
        if (settings.law == ReferenceLaw::foundation) lay_foundations();
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
                if (materials.mass[at(v)] <= 0.0 || materials.pinned[at(v)] != 0) continue;
                node_of_vertex[at(v)] = static_cast<Index>(vertex_of_node.size());
                vertex_of_node.push_back(v);
                node_mass.push_back(materials.mass[at(v)]);
                node_drag.push_back(materials.drag[at(v)]);
                places.emplace_back(x.col(v));
            }
        }
        for (Index b = 0; b < topology.body_count(); ++b) {
            const BodyRange& body = topology.bodies[at(b)];
            const auto& motion = scene.bodies[at(b)].motion;
            if (body.kind != BodyKind::instrument || !motion || motion->drive != Drive::simulated_operator) continue;
            auto hand = std::find_if(hands.begin(), hands.end(), [&](const Hand& other) {
                return !body.instrument.empty() &&
                       topology.bodies[at(other.bodies.front())].instrument == body.instrument;
            });
            if (hand == hands.end()) {
                hands.push_back(
                    {.bodies = {}, .node = static_cast<Index>(vertex_of_node.size()), .model = motion->hand});
                hand = hands.end() - 1;
                vertex_of_node.push_back(-1);
                node_mass.push_back(motion->hand.mass);
                node_drag.push_back(0.0);
                places.push_back(motion->pose_at(0.0).translation);
            }
            hand->bodies.push_back(b);
            body_moves[at(b)] = 1;
            for (Index v = body.vertices.first; v < body.vertices.end(); ++v) node_of_vertex[at(v)] = hand->node;
        }
        node.resize(3, static_cast<Eigen::Index>(places.size()));
        for (std::size_t n = 0; n < places.size(); ++n) node.col(static_cast<Eigen::Index>(n)) = places[n];
        for (const auto& [a, b] : topology.body_pairs) {
            if (body_moves[at(a)] != 0 || body_moves[at(b)] != 0) contact_bodies.push_back({a, b});
        }
    }

    void find_features() {
        first_triangle_of_vertex.assign(at(topology.vertex_count), -1);
        std::map<std::array<Index, 2>, Index> known;
        for (Index t = 0; t < topology.triangle_count(); ++t) {
            edges_of_triangle.emplace_back();
            for (int corner = 0; corner < 3; ++corner) {
                const Index a = topology.triangles(corner, t);
                const Index b = topology.triangles((corner + 1) % 3, t);
                if (first_triangle_of_vertex[at(a)] < 0) first_triangle_of_vertex[at(a)] = t;
                const auto [found, added] =
                    known.emplace(std::array{std::min(a, b), std::max(a, b)}, static_cast<Index>(edges.size()));
                if (added) {
                    edges.push_back(found->first);
                    first_triangle_of_edge.push_back(t);
                }
                edges_of_triangle.back()[static_cast<std::size_t>(corner)] = found->second;
            }
        }
    }

    double triangle_area(Index t) const {
        const auto corner = topology.triangles.col(t);
        const Vector3 a = scene.first.position.col(corner[0]);
        const Vector3 b = scene.first.position.col(corner[1]);
        const Vector3 c = scene.first.position.col(corner[2]);
        return 0.5 * (b - a).cross(c - a).norm();
    }

    void lay_foundations() {
        masters.resize(topology.bodies.size());
        for (const auto& [a, b] : contact_bodies) {
            const bool tissue_a = topology.bodies[at(a)].kind == BodyKind::tissue;
            const bool tissue_b = topology.bodies[at(b)].kind == BodyKind::tissue;
            const ContactLaw law = materials.contact_laws[at(topology.body_pair(a, b))];
            const double share = tissue_a && tissue_b ? 0.5 : 1.0;
            if (tissue_b) lay(b, a, law, share);
            if (tissue_a || !tissue_b) lay(a, b, law, share);
        }
    }

    void lay(Index slave, Index master, const ContactLaw& law, double share) {
        const BodyRange& body = topology.bodies[at(slave)];
        Foundation foundation;
        foundation.slave = slave;
        foundation.master = master;
        double total = 0.0;
        for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
            foundation.area.push_back(triangle_area(t));
            total += foundation.area.back();
        }
        const double mean_area = total / body.vertices.count;
        const bool tissue = body.kind == BodyKind::tissue;
        const double k = std::isnan(law.k) ? (tissue ? kappa_default * mean_area : k_default) : law.k;
        foundation.kappa = share * k / mean_area;
        foundation.eta = share * (std::isnan(law.mu) ? mu_default : law.mu) / mean_area;
        // Centroids of the n² equal triangles into which a triangle is cut.
        const int n = settings.foundation_points;
        for (int i = 0; i < n; ++i) {
            for (int j = 0; i + j < n; ++j) {
                const double third = 1.0 / 3.0;
                foundation.weights.emplace_back((i + third) / n, (j + third) / n, 1.0 - (i + j + 2.0 * third) / n);
                if (i + j + 1 < n) {
                    foundation.weights.emplace_back((i + 2.0 * third) / n, (j + 2.0 * third) / n,
                                                    1.0 - (i + j + 4.0 * third) / n);
                }
            }
        }
        foundation.depth_before.assign(foundation.area.size() * foundation.weights.size(), 0.0);
        foundation.clearance.assign(foundation.depth_before.size(), 0.0);
        foundation.looked_from = x;
        masters[at(master)].prepare(topology.triangles, topology.bodies[at(master)].triangles, x);
        foundation.most_depth = most_depth_of(master);
        foundations.push_back(std::move(foundation));
        if (topology.bodies[at(master)].closed) return;
        double sum = 0.0;
        for_each_sample(foundations.back(), [&](std::size_t, Index, const Vector3&, double area,
                                                const SurfacePoint& near) { sum += area * near.signed_distance; });
        foundations.back().side = sum < 0.0 ? -1.0 : 1.0;
        std::fill(foundations.back().clearance.begin(), foundations.back().clearance.end(), 0.0);
    }

    /// Three quarters of the largest depth inside a closed body (found by going inwards from every face), or the reach
    /// of an open one.
    double most_depth_of(Index master) const {
        if (!topology.bodies[at(master)].closed) return open_reach;
        const SignedDistance& surface = masters[at(master)];
        const BodyRange& body = topology.bodies[at(master)];
        const double size = (surface.box().max - surface.box().min).maxCoeff();
        double deepest = 0.0;
        for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
            const auto corner = topology.triangles.col(t);
            const Vector3 a = x.col(corner[0]);
            const Vector3 b = x.col(corner[1]);
            const Vector3 c = x.col(corner[2]);
            const Vector3 inwards = -(b - a).cross(c - a).normalized();
            constexpr int places = 64;
            for (int i = 1; i <= places; ++i) {
                const Vector3 place = (a + b + c) / 3.0 + 0.5 * size * i / places * inwards;
                const double depth = -surface.nearest(topology.triangles, x, place).signed_distance;
                if (depth <= 0.0) break;
                deepest = std::max(deepest, depth);
            }
        }
        return 0.75 * deepest;
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
        for (const Hand& hand : hands) {
            const OperatorModel& model = hand.model;
            const Vector3 off = node.col(hand.node) - hand.target;
            value += 0.5 * model.hand_stiffness * off.squaredNorm();
            Vector3 g = model.hand_stiffness * off;
            double stiffness = model.hand_stiffness;
            if (!settings.quasi_static) {
                const Vector3 rate = alpha * (node.col(hand.node) - coast.col(hand.node));
                const Vector3 relative = rate - hand.target_velocity;
                value +=
                    0.5 / alpha * (model.hand_damping * relative.squaredNorm() + model.damping * rate.squaredNorm());
                g += model.hand_damping * relative + model.damping * rate;
                stiffness += alpha * (model.hand_damping + model.damping);
            }
            if (!derivatives) continue;
            push(hand.node, g);
            matrix.add(hand.node, hand.node, stiffness * Matrix3::Identity());
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
        return settings.law == ReferenceLaw::hard ? barrier_part(derivatives) : foundation_part(derivatives);
    }

    double barrier_part(bool derivatives) {
        double value = 0.0;
        if (derivatives) last_gap = std::numeric_limits<double>::infinity();
        for (std::size_t c = 0; c < candidates.size(); ++c) {
            const FeaturePair& pair = candidates[c];
            const FeatureDistance near = distance_of(pair, points_of(pair, x));
            if (derivatives) last_gap = std::min(last_gap, near.distance);
            if (near.distance >= settings.rest_gap || candidate_weight[c] == 0.0) continue;
            if (near.distance == 0.0) return std::numeric_limits<double>::infinity();
            const Barrier b = barrier(near.distance, settings.rest_gap);
            value += candidate_weight[c] * b.value;
            if (!derivatives) continue;
            Term term;
            term.slope = candidate_weight[c] * b.slope;
            term.curvature = candidate_weight[c] * b.curvature;
            for (std::size_t i = 0; i < 4; ++i) {
                if (near.weight[i] == 0.0) continue;
                term.vertex.at(static_cast<std::size_t>(term.count)) = pair.vertex[i];
                term.gradient.at(static_cast<std::size_t>(term.count++)) = near.weight[i] * near.normal;
            }
            terms.push_back(term);
        }
        return value;
    }

    double foundation_part(bool derivatives) {
        double value = 0.0;
        if (derivatives) last_gap = std::numeric_limits<double>::infinity();
        for (std::size_t b = 0; b < masters.size(); ++b) {
            if (!masters[b].empty()) masters[b].refit(topology.triangles, x);
        }
        for (Foundation& foundation : foundations) {
            for_each_sample(
                foundation, [&](std::size_t sample, Index t, const Vector3& w, double area, const SurfacePoint& near) {
                    const double depth = -near.signed_distance;
                    const double rate_factor = settings.quasi_static ? 0.0 : foundation.eta / settings.time_step;
                    const double stiffness = area * (foundation.kappa + rate_factor);
                    const double free_depth =
                        foundation.depth_before[sample] * rate_factor / (foundation.kappa + rate_factor);
                    if (derivatives) last_gap = std::min(last_gap, -depth);
                    const double pressed = depth - free_depth;
                    if (pressed <= 0.0) return;
                    value += 0.5 * stiffness * pressed * pressed;
                    if (!derivatives) return;
                    Term term;
                    term.slope = stiffness * pressed;
                    term.curvature = stiffness;
                    term.count = 6;
                    for (std::size_t i = 0; i < 3; ++i) {
                        const auto corner = static_cast<Eigen::Index>(i);
                        term.vertex.at(i) = topology.triangles(corner, t);
                        term.gradient.at(i) = -w[corner] * near.normal;
                        term.vertex.at(3 + i) = topology.triangles(corner, near.triangle);
                        term.gradient.at(3 + i) = near.weights[corner] * near.normal;
                    }
                    terms.push_back(term);
                });
        }
        return value;
    }

    /// Calls with every sample point that may be inside the other body and the nearest point of that body.
    template <typename Use>
    void for_each_sample(Foundation& foundation, Use&& use) {
        const SignedDistance& master = masters[at(foundation.master)];
        const BodyRange& body = topology.bodies[at(foundation.slave)];
        const bool closed = topology.bodies[at(foundation.master)].closed;
        Box reach = master.box();
        if (!closed) {
            reach.min.array() -= open_reach;
            reach.max.array() += open_reach;
        }
        const auto moved_of = [&](Range range) {
            return (x - foundation.looked_from).middleCols(range.first, range.count).colwise().norm().maxCoeff();
        };
        double moved = moved_of(body.vertices) + moved_of(topology.bodies[at(foundation.master)].vertices);
        constexpr double look_again = 3e-4;  // m
        if (moved > look_again) {
            foundation.looked_from = x;
            std::fill(foundation.clearance.begin(), foundation.clearance.end(), 0.0);
            moved = 0.0;
        }
        const std::size_t points = foundation.weights.size();
        for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
            const auto corner = topology.triangles.col(t);
            Box box;
            for (int i = 0; i < 3; ++i) box.add(x.col(corner[i]));
            if (!box.overlaps(reach)) continue;
            const std::size_t first = at(t - body.triangles.first);
            for (std::size_t p = 0; p < points; ++p) {
                double& clearance = foundation.clearance[first * points + p];
                if (clearance > moved) continue;
                const Vector3& w = foundation.weights[p];
                const Vector3 place = w[0] * x.col(corner[0]) + w[1] * x.col(corner[1]) + w[2] * x.col(corner[2]);
                Box point;
                point.add(place);
                if (!point.overlaps(reach)) continue;
                SurfacePoint near = master.nearest(topology.triangles, x, place);
                if (near.triangle < 0 || (!closed && near.beyond_rim)) continue;
                near.signed_distance *= foundation.side;
                near.normal *= foundation.side;
                clearance = std::max(0.0, near.signed_distance - moved);
                use(first * points + p, t, w, foundation.area[first] / static_cast<double>(points), near);
            }
        }
    }

    /// False when a point is so deep that its shortest way out is no longer the way in.
    bool remember_depths() {
        bool shallow = true;
        for (Foundation& foundation : foundations) {
            std::fill(foundation.depth_before.begin(), foundation.depth_before.end(), 0.0);
            for_each_sample(foundation,
                            [&](std::size_t sample, Index, const Vector3&, double, const SurfacePoint& near) {
                                foundation.depth_before[sample] = std::max(0.0, -near.signed_distance);
                                shallow = shallow && -near.signed_distance <= foundation.most_depth;
                            });
        }
        return shallow;
    }

    void add_terms() {
        for (const Term& term : terms) {
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
        for (const Term& term : terms) {
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

    // ------------------------------------------------------------ contact geometry of the hard law
    static std::array<Vector3, 4> points_of(const FeaturePair& pair, const Matrix3X& positions) {
        std::array<Vector3, 4> points;
        for (std::size_t i = 0; i < 4; ++i) points[i] = positions.col(pair.vertex[i]);
        return points;
    }

    /// All feature pairs that may come within rest_gap on the way x + t motion, t in [0, 1].
    void find_candidates(const Matrix3X& motion) {
        candidates.clear();
        candidate_weight.clear();
        boxes.resize(at(topology.triangle_count()));
        for (Index t = 0; t < topology.triangle_count(); ++t) {
            Box box;
            for (int i = 0; i < 3; ++i) {
                const Index v = topology.triangles(i, t);
                box.add(x.col(v));
                box.add(x.col(v) + motion.col(v));
            }
            box.min.array() -= settings.rest_gap;
            box.max.array() += settings.rest_gap;
            boxes[at(t)] = box;
        }
        for (const auto& [a, b] : contact_bodies) {
            overlapping_boxes(boxes, topology.bodies[at(a)].triangles, topology.bodies[at(b)].triangles, box_pairs);
            for (const IndexPair& pair : box_pairs) add_features(pair.first, pair.second);
        }
    }

    void add_features(Index t, Index u) {
        const auto face = [&](Index triangle) { return topology.triangles.col(triangle); };
        const auto add = [&](const FeaturePair& pair, double weight) {
            bool any_moves = false;
            for (const Index v : pair.vertex) any_moves = any_moves || node_of_vertex[at(v)] >= 0;
            if (!any_moves) return;
            candidates.push_back(pair);
            candidate_weight.push_back(weight);
        };
        // A feature within reach of a face has all its triangles within reach of it: the first one stands for them.
        for (const auto& [from, to] : {std::pair{t, u}, std::pair{u, t}}) {
            for (int i = 0; i < 3; ++i) {
                const Index v = face(from)[i];
                if (first_triangle_of_vertex[at(v)] != from) continue;
                add({FeaturePair::Kind::vertex_face, {v, face(to)[0], face(to)[1], face(to)[2]}}, 1.0);
            }
        }
        for (const Index e : edges_of_triangle[at(t)]) {
            if (first_triangle_of_edge[at(e)] != t) continue;
            for (const Index f : edges_of_triangle[at(u)]) {
                if (first_triangle_of_edge[at(f)] != u) continue;
                const FeaturePair pair{FeaturePair::Kind::edge_edge,
                                       {edges[at(e)][0], edges[at(e)][1], edges[at(f)][0], edges[at(f)][1]}};
                add(pair, edge_weight(pair));
            }
        }
    }

    /// Closest points of parallel edges are not unique; such pairs fade out (vertex-face pairs carry them), judged at
    /// the start of the step so that the potential does not change under the solver.
    double edge_weight(const FeaturePair& pair) const {
        const auto point = [&](std::size_t i) {
            const Index v = pair.vertex[i];
            const Index n = node_of_vertex[at(v)];
            if (n < 0) return Vector3(x.col(v) - progress * script.col(v));
            return Vector3(x.col(v) - progress * script.col(v) - node.col(n) + node_start.col(n));
        };
        const Vector3 a = point(1) - point(0);
        const Vector3 b = point(3) - point(2);
        const double square = a.cross(b).squaredNorm();
        const double limit = 1e-3 * a.squaredNorm() * b.squaredNorm();
        if (square >= limit) return 1.0;
        const double r = square / limit;
        return r * (2.0 - r);
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

    /// Where the script leads all that is not free in this step, and what the operators want.
    void read_script(double target_time) {
        Matrix3X target = x;
        for (Index b = 0; b < topology.body_count(); ++b) {
            const auto& motion = scene.bodies[at(b)].motion;
            if (!motion) continue;
            Pose pose = motion->pose_at(target_time);
            if (motion->drive == Drive::simulated_operator) {
                const auto hand = std::find_if(hands.begin(), hands.end(), [&](const Hand& h) {
                    return std::find(h.bodies.begin(), h.bodies.end(), b) != h.bodies.end();
                });
                if (hand == hands.end()) continue;
                if (hand->bodies.front() == b) {
                    const Vector3 before = motion->pose_at(target_time - settings.time_step).translation;
                    hand->target = pose.translation;
                    hand->target_velocity = (pose.translation - before) / settings.time_step;
                }
                pose.translation += node.col(hand->node) - hand->target;
            }
            place_body(scene.bodies[at(b)], topology.bodies[at(b)].vertices, pose, target);
        }
        script = target - x;
        // Free vertices go where the solution leads them; an operator's body is turned by its script.
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
        // BDF2 takes the way so far for smooth; where it is not (the start, a key of the script) it would shift all
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
        if (settings.law == ReferenceLaw::foundation) {
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
        if (settings.law == ReferenceLaw::foundation && !remember_depths()) {
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
        for (const Term& term : terms) last_contact = std::max(last_contact, std::abs(term.slope));
    }

    bool solve() {
        Matrix3X motion = Matrix3X::Zero(3, topology.vertex_count);
        if (settings.law == ReferenceLaw::hard) {
            // Where nothing is in the way, bodies go where the script puts them at once.
            find_candidates(script);
            if (candidates.empty() && script_moves) {
                x += script;
                script.setZero();
                script_moves = false;
                progress = 1.0;
            }
            find_candidates(motion);
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
            if (settings.law == ReferenceLaw::hard) {
                // No vertex leaves the neighbourhood in which its candidates are few.
                const double longest = motion.colwise().norm().maxCoeff();
                constexpr double most_motion = 0.005;
                if (longest > most_motion) part = most_motion / longest;
                motion *= part;
                direction *= part;
                part = 1.0;
                find_candidates(motion);
                for (const FeaturePair& pair : candidates) {
                    part = std::min(part, safe_part_of_motion(pair, points_of(pair, x), points_of(pair, motion)));
                }
            }
            const double slope = gradient.dot(direction);
            const bool close = last_residual <= 100.0 * allowed && 1.0 - progress <= 1e-3;
            if (!line_search(value, slope, part)) {
                // Rounding hides what is left to gain: as good as it gets.
                if (close) return true;
                return fail(fmt::format("no descent at a residual of {:.2e} N", last_residual));
            }
            // On a ridge, such as a point on a corner, it creeps for ever: the balance there is one all the same.
            if (close && iteration >= patience) return true;
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
    for (const Term& term : state_->terms) {
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
