// Stepper `adaptive_multires`: linearly implicit Euler on an active set around the contacts at full rate. Outside it, a
// hierarchy of a few hundred nodes is solved and interpolated; its vertices are updated in slices.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "method/registry.hpp"
#include "tissue/far_field.hpp"
#include "tissue/implicit_system.hpp"
#include "tissue/region_levels.hpp"
#include "tissue/tick_contacts.hpp"
#include "tissue/written_vertices.hpp"

namespace trocar {
namespace {

struct AdaptiveMultiresSettings {
    double error = 0.01;
    std::size_t relaxations = 250;
    std::size_t whole = 2000;
    ImplicitSystem::Accuracy accuracy = {.tolerance = 0.002, .iterations = 1000};
};

class AdaptiveMultiresStepper final : public Stepper {
public:
    explicit AdaptiveMultiresStepper(const AdaptiveMultiresSettings& settings)
        // Displacement falls with the logarithm of the distance and is linear between nodes. The error in its stiffness
        // thus falls with the square of distance over spacing; measured on sheets (METHODS §4).
        : settings_(settings), rings_(static_cast<int>(std::ceil(2.3 * std::sqrt(0.042 / settings.error)))) {
        // Rounding up to whole rings leaves a margin that falls with the bound to the power 3/2; a step's residual fits
        // it.
        settings_.accuracy.tolerance = std::min(settings.accuracy.tolerance, 2.0 * std::pow(settings.error, 1.5));
    }

    void prepare(const Topology& topology, const Materials& materials) override {
        tissue_.emplace(topology, materials);
        topology_ = &topology;
        boxes_.emplace(topology);
        largest_move_ = 0.0;
        std::size_t moving = 0;
        for (const double inverse : tissue_->state().inverse_mass) moving += inverse != 0.0 ? 1 : 0;
        whole_.reset();
        region_.reset();
        has_moved_ = false;
        if (moving <= settings_.whole || !tissue_->volumes().none()) {
            whole_ = make_stepper("implicit");
            whole_->prepare(topology, materials);
            return;
        }
        contacts_.emplace(topology.vertex_count, tissue_->state().size());
        searches_.clear();
        written_.emplace(tissue_->state());
        is_known_ = false;
        is_trusted_ = false;
        is_filled_ = true;
        tick_ = 0;
        max_strain_ = 0.0;
        limited_edges_ = 0;
    }

    void start(const Frame& first) override {
        if (!whole_) build(first);
    }

    [[nodiscard]] StepEstimate estimate(const Topology& /*topology*/, const Materials& materials,
                                        const Matrix3X& /*position*/, double /*dt*/, bool /*closely*/) const override {
        StepEstimate estimate;  // no step limit
        estimate.springs = static_cast<std::int64_t>(materials.springs.size());
        return estimate;
    }

    Outcome advance(const ResponseOutput& output, double dt, const Frame& from, Frame& to,
                    std::vector<Wrench>& reaction) override {
        if (whole_) return whole_->advance(output, dt, from, to, reaction);
        if (!region_) build(from);
        TissueState& state = tissue_->state();
        const bool ours = is_known_ && (is_trusted_ || is_ours(from));
        has_moved_ = false;
        written_->next_tick();
        if (!ours || !is_trusted_) written_->mark_all();
        if (ours) {
            tissue_->take_output(output, from);
        } else {
            tissue_->take_over(output, from);
            begin_anew(from);
        }
        boxes_->follow(from);
        region_->take_path();
        gather_seeds(output);
        choose_region();
        contacts_->collect(output, from, state, late_);
        const bool known = output.contact_timing != ContactTiming::implicit;
        contacts_->begin_substep(state);
        if (region_->take_changed() || system_->listed_for() != dt) system_->list(dt);
        for (const auto& [level, node] : system_->interpolated()) region_->refresh(level, node);
        system_->linearise();
        const std::size_t slice = state.size() / 16;
        const std::size_t relaxations = std::min(settings_.relaxations, slice);
        far_field_->follow(relaxations, slice - relaxations);
        system_->solve(known, 1, settings_.accuracy, *contacts_);
        double furthest = system_->move();
        region_->next_moment();
        for (const auto& [level, node] : system_->interpolated()) {
            if (level == 0) region_->refresh(level, node);
        }
        furthest += contacts_->shift(*tissue_);
        ++tick_;  // also after a failed tick, because its search marks must not match those of the next
        if (!contacts_->all().empty()) contacts_->finish_substep(dt, 1, state);
        Outcome outcome = tissue_->check(std::isfinite(furthest), furthest, output, from);
        if (outcome.ok()) limit_strain();
        tissue_->release(output);
        if (!outcome.ok()) {
            is_known_ = false;
            return outcome;
        }
        largest_move_ = std::max(longest_path(from), region_->take_path());
        for (const Index local : region_->levels()[0].active_nodes) written_->mark(local);
        written_->give_back(*tissue_, output, from, to);
        has_moved_ = true;
        contacts_->react(reaction);
        return outcome;
    }

    void trust_frames(bool trusted) override { is_trusted_ = trusted; }
    [[nodiscard]] const std::vector<Range>* moved() const override { return has_moved_ ? &written_->moved() : nullptr; }
    [[nodiscard]] bool leaves_behind() const override { return !whole_; }
    void complete(Frame& frame) const override {
        if (region_) region_->complete(frame);
    }
    [[nodiscard]] std::span<const ContactForce> contact_forces() const override {
        return whole_ ? whole_->contact_forces() : contacts_->contact_forces();
    }
    [[nodiscard]] double max_strain() const override { return whole_ ? whole_->max_strain() : max_strain_; }
    [[nodiscard]] std::int64_t limited_edges() const override {
        return whole_ ? whole_->limited_edges() : limited_edges_;
    }
    [[nodiscard]] double largest_move() const override { return whole_ ? whole_->largest_move() : largest_move_; }

private:
    static constexpr std::int64_t never = -1'000'000;
    /// Buffers of a search along the edges of a level, from the nodes of the seeds.
    struct Search {
        std::vector<Index> queue;
        std::vector<std::int64_t> marked;  ///< tick in which a node was last in the region
        std::vector<std::int64_t> walk;    ///< tick of the last search that met it
    };

    /// Builds the levels at the positions of the first frame.
    void build(const Frame& from) {
        tissue_->take_over(nothing_, from);
        constexpr std::size_t fewest = 300;
        region_.emplace(*tissue_, *written_, *boxes_, *topology_, from.position, fewest);
        system_.emplace(*tissue_, region_->levels());
        far_field_.emplace(*region_);
        for (const NodeLevel& level : region_->levels()) {
            Search& search = searches_.emplace_back();
            search.queue.reserve(level.size());
            search.marked.assign(level.size(), never);
            search.walk.assign(level.size(), never);
        }
        seeds_.reserve(tissue_->state().size());
        limited_.reserve(tissue_->spring_arrays().size());
        late_.assign(tissue_->state().size(), Vector3::Zero());
        is_late_.clear();
        is_late_.reserve(tissue_->state().size());
    }

    /// True if the frame holds the last result of this stepper.
    [[nodiscard]] bool is_ours(const Frame& frame) const {
        const TissueState& state = tissue_->state();
        std::uint64_t differ = 0;
        const auto compare = [&differ](const double* a, const double* b) {
            for (int axis = 0; axis < 3; ++axis) {
                differ |= std::bit_cast<std::uint64_t>(a[axis]) ^ std::bit_cast<std::uint64_t>(b[axis]);
            }
        };
        for (std::size_t v = 0; v < state.size(); ++v) {
            const auto local = static_cast<Eigen::Index>(v);
            compare(frame.position.col(state.vertex[v]).data(), state.position.col(local).data());
            compare(frame.velocity.col(state.vertex[v]).data(), state.velocity.col(local).data());
        }
        return differ == 0;
    }

    /// Restarts from a foreign frame: every vertex without velocity is interpolated.
    void begin_anew(const Frame& from) {
        const TissueState& state = tissue_->state();
        region_->start();
        boxes_->start(from);
        far_field_->start();
        system_->forget();
        for (std::size_t v = 0; v < state.size(); ++v) {
            if (from.velocity.col(state.vertex[v]).isZero(0.0)) continue;
            const auto local = static_cast<Index>(v);
            region_->activate(0, local);
            tissue_->state().velocity.col(local).head<3>() = from.velocity.col(state.vertex[v]);
        }
        is_known_ = true;
    }

    /// Collects the vertices on which contacts, position corrections and held forces act, and activates them.
    void gather_seeds(const ResponseOutput& output) {
        TissueState& state = tissue_->state();
        seeds_.clear();
        for (const Index local : is_late_) late_[at(local)].setZero();
        is_late_.clear();
        const auto take = [&](Index vertex) {
            const Index local = vertex < 0 ? -1 : state.place[at(vertex)];
            if (local < 0 || searches_[0].walk[at(local)] == tick_) return;
            if (region_->levels()[0].fixed[at(local)] != 0) return;
            searches_[0].walk[at(local)] = tick_;
            seeds_.push_back(local);
            if (region_->levels()[0].active[at(local)] != 0) return;
            const Vector3 shown = state.position.col(local).head<3>();
            region_->activate(0, local);
            late_[at(local)] = state.position.col(local).head<3>() - shown;
            is_late_.push_back(local);
            is_filled_ = false;
        };
        for (const ContactForceLaw& contact : output.contacts) {
            for (const Index vertex : contact.vertices) take(vertex);
            for (const Index vertex : contact.reaction_vertices) take(vertex);
        }
        for (const PositionCorrection& position_correction : output.position_corrections) {
            const Index local = state.place[at(position_correction.vertex)];
            if (local < 0 || region_->levels()[0].fixed[at(local)] != 0) continue;
            take(position_correction.vertex);
            state.position.col(local).head<3>() = position_correction.position;
            state.velocity.col(local).head<3>() = position_correction.velocity;
            late_[at(local)].setZero();  // the correction sets the position, and contacts refer to the frame
        }
        for (Index v = 0; tissue_->is_pushed() && v < output.held_force.cols(); ++v) {
            if (!output.held_force.col(v).isZero(0.0)) take(v);
        }
    }

    /// Activates the nodes within rings around the seeds, level by level. Interpolates nodes that were outside for
    /// long.
    void choose_region() {
        constexpr std::int64_t seldom = 4;
        if (is_filled_ && tick_ % seldom != 0) return;
        is_filled_ = true;
        std::vector<NodeLevel>& levels = region_->levels();
        for (std::size_t level = 0; level + 1 < levels.size(); ++level) {
            NodeLevel& here = levels[level];
            Search& search = searches_[level];
            if (level == 0) {
                search.queue.assign(seeds_.begin(), seeds_.end());
            } else {
                // The seeds of the level below come first in its queue.
                search.queue.clear();
                for (std::size_t n = 0; n < seed_count_; ++n) {
                    const Index child = searches_[level - 1].queue[n];
                    for (std::size_t p = 0; p < 3; ++p) {
                        const Index parent = levels[level - 1].parent[at(child)][p];
                        if (levels[level - 1].weight[at(child)][p] == 0.0 || search.walk[at(parent)] == tick_) continue;
                        search.walk[at(parent)] = tick_;
                        search.queue.push_back(parent);
                    }
                }
            }
            seed_count_ = search.queue.size();
            walk_rings(rings_of(level), here, search);
            int activations = level == 0 ? 64 : 32;
            for (const Index node : search.queue) {
                search.marked[at(node)] = tick_;
                if (here.active[at(node)] != 0 || here.fixed[at(node)] != 0) continue;
                if (activations == 0) {
                    is_filled_ = false;
                    continue;
                }
                --activations;
                region_->activate(level, node);
            }
            constexpr std::int64_t patience = 64;  // ticks
            int is_interpolated = level == 0 ? 16 : 2;
            for (std::size_t n = 0; n < here.active_nodes.size() && is_interpolated > 0;) {
                const Index node = here.active_nodes[n];
                if (search.marked[at(node)] + patience > tick_) {
                    ++n;
                    continue;
                }
                region_->interpolate(level, node);
                --is_interpolated;
            }
        }
    }

    /// Vertices beyond a few rings around the contacts hardly reduce the error; the coarse levels do most.
    [[nodiscard]] int rings_of(std::size_t level) const {
        if (level == 0) return (3 * rings_ + 4) / 5;
        return level == 1 ? rings_ : rings_ + 1;
    }

    void walk_rings(int rings, const NodeLevel& level, Search& search) const {
        std::size_t begin = 0;
        for (int ring = 0; ring < rings; ++ring) {
            const std::size_t end = search.queue.size();
            for (; begin < end; ++begin) {
                const Index node = search.queue[begin];
                for (const std::uint32_t edge : level.edges.of(node)) {
                    const Index other = level.other_end(edge, node);
                    if (search.walk[at(other)] == tick_) continue;
                    search.walk[at(other)] = tick_;
                    search.queue.push_back(other);
                }
            }
        }
    }

    /// m, largest displacement of active vertices that may have met another body.
    [[nodiscard]] double longest_path(const Frame& from) {
        double longest = 0.0;
        for (const Index local : region_->levels()[0].active_nodes) {
            longest = region_->further(local, from.position.col(tissue_->state().vertex[at(local)]), longest);
        }
        return longest;
    }

    /// Applies the strain limit (METHODS §4) to the active vertices and measures the remaining strain.
    void limit_strain() {
        TissueState& state = tissue_->state();
        const double longest = 1.0 + tissue_->materials().strain_limit;
        const double stretch = far_field_->stretch();
        const std::span<const SystemSpring> springs = system_->springs();
        const auto stretch_of = [&](const SystemSpring& spring) {
            return (state.position.col(spring.j) - state.position.col(spring.i)).head<3>().norm() * spring.inverse_rest;
        };
        double near = 0.0;
        for (const SystemSpring& spring : springs) near = std::max(near, stretch_of(spring));
        limited_edges_ = 0;
        constexpr double rounding = 1e-12;
        if (near > longest * (1.0 - rounding)) {
            // As on the whole tissue, with interpolated vertices fixed.
            const std::vector<std::uint8_t>& active = region_->levels()[0].active;
            const auto gives = [&](Index local) {
                return active[at(local)] != 0 ? state.inverse_mass[at(local)] : 0.0;
            };
            limited_.assign(springs.size(), 0);
            for (int pass = 0; pass < limit_passes; ++pass) {
                for (std::size_t s = 0; s < springs.size(); ++s) {
                    const SystemSpring& spring = springs[s];
                    if (spring.inverse_rest == 0.0) continue;
                    const double limit = longest / spring.inverse_rest;
                    if (shorten(spring.i, spring.j, limit, gives(spring.i), gives(spring.j), state)) limited_[s] = 1;
                }
            }
            limited_edges_ = std::count(limited_.begin(), limited_.end(), std::uint8_t{1});
            near = 0.0;
            for (const SystemSpring& spring : springs) near = std::max(near, stretch_of(spring));
        }
        max_strain_ = std::max(0.0, std::max(stretch, near) - 1.0);
    }

    AdaptiveMultiresSettings settings_;
    int rings_;                       ///< rings around the seeds of level 1
    std::unique_ptr<Stepper> whole_;  ///< stepper of the whole tissue, if a region does not pay
    ResponseOutput nothing_;
    const Topology* topology_ = nullptr;
    std::optional<MovingTissue> tissue_;
    std::optional<BodyBoxes> boxes_;
    std::optional<RegionTissue> region_;
    std::optional<FarField> far_field_;
    std::optional<ImplicitSystem> system_;
    std::optional<TickContacts> contacts_;
    std::vector<Search> searches_;  ///< per level
    std::vector<Index> seeds_;
    std::vector<Vector3> late_;   ///< m, per vertex: its lag when it became active in this tick
    std::vector<Index> is_late_;  ///< vertices with a lag
    std::size_t seed_count_ = 0;
    std::optional<WrittenVertices> written_;
    bool is_known_ = false;
    bool is_trusted_ = false;  ///< frames are results of this stepper, unchanged
    bool has_moved_ = false;   ///< `written_` holds the ranges that the last advance moved
    bool is_filled_ = true;
    std::int64_t tick_ = 0;
    double max_strain_ = 0.0;
    std::int64_t limited_edges_ = 0;
    std::vector<std::uint8_t> limited_;  ///< per spring of the system
    double largest_move_ = 0.0;
};

}  // namespace

StepperEntry adaptive_multires_stepper() {
    StepperEntry entry;
    entry.name = "adaptive_multires";
    entry.version = "1";
    entry.meaning = "linearly implicit Euler at full rate around what touches the tissue, the far field in slices";
    entry.takes_contact_force_laws = true;
    entry.takes_solved_contacts = true;
    entry.takes_position_corrections = true;
    entry.takes_held_forces = true;
    entry.parameters = {
        number_parameter(
            "error", "1", "0.01", 1e-4, 0.1,
            "bound on the error of the force at a tool, as a part of it, on meshes with even faces: sets how far the "
            "fine region reaches"),
        integer_parameter(
            "relaxations", "250", 3, 1e7,
            "most vertices of the far field that are followed in a tick, those first that have gone furthest"),
        integer_parameter("whole", "2000", 0, 1e7,
                          "tissue of up to so many moving vertices is stepped as a whole, by `implicit`"),
        number_parameter(
            "tolerance", "1", "0.002", 1e-14, 0.1,
            "what a step leaves open of its momentum, as a part of what contacts give in it (2 `error`^1.5 at most), "
            "or a tenth of that, of all that acts"),
        integer_parameter("iterations", "1000", 1, 100000, "most iterations of conjugate gradients for one system")};
    entry.make = [](const ParameterValues& values) {
        const auto count = [&values](const char* name) { return static_cast<std::size_t>(values.integer(name)); };
        return std::make_unique<AdaptiveMultiresStepper>(
            AdaptiveMultiresSettings{.error = values.number("error"),
                                     .relaxations = count("relaxations"),
                                     .whole = count("whole"),
                                     .accuracy = {.tolerance = values.number("tolerance"),
                                                  .iterations = static_cast<int>(values.integer("iterations"))}});
    };
    return entry;
}

}  // namespace trocar
