// Lengths are metres. Every number comes from +, -, *, /, square root and the sines of scene/rotation, so that no C
// library can change a bit.
#include "simulate/generated_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "geometry/input_error.hpp"
#include "geometry/size_limits.hpp"
#include "geometry/triangle_sides.hpp"
#include "method/registry.hpp"
#include "scene/rotation.hpp"
#include "scene/shapes.hpp"
#include "simulate/vertex_order.hpp"

namespace trocar {
namespace {

constexpr double slab_size = 0.1;
constexpr double slab_thickness = 0.01;
constexpr double slab_pitch = 0.13;  ///< from slab to slab along x
constexpr double wave_length = 0.025;
constexpr double wave_height = 0.00025;
constexpr double motion_period = 64.0;  ///< steps
constexpr double hollow = 6.0;          ///< 1/m: rise of the near variant's bowl over the squared distance
constexpr double local_radius = 0.008;
constexpr double jaw_length = 0.02;
constexpr double jaw_radius = 0.002;
constexpr double shaft_radius = 0.0025;
constexpr double shaft_length = 0.1;
constexpr double jaw_opening = 8.0;  ///< degrees, mean

Surface make_shape(std::string_view name, std::map<std::string, std::vector<double>, std::less<>> numbers) {
    ShapeValues values;
    values.numbers = std::move(numbers);
    values.words["tip"] = "round";
    return find_shape(name)->make(values);
}

/// Edge length with which `make` gives about `wanted` triangles, found by halving; counts fall with the edge.
template <typename Make>
double edge_for(Index wanted, Make make) {
    double fine = 0.02;
    while (make(fine).triangles.cols() < wanted) fine /= 2.0;
    double coarse = 2.0 * fine;
    while (fine < coarse * (1.0 - 1e-3)) {
        const double middle = std::sqrt(fine * coarse);
        (make(middle).triangles.cols() >= wanted ? fine : coarse) = middle;
    }
    return fine;
}

/// 4 n (n + 2 h) triangles on an n × n × h grid, h = n / 10.
Surface make_slab(Index wanted) {
    const double n = std::max(2.0, std::round(std::sqrt(wanted / 4.8)));
    return make_shape("box", {{"size", {slab_size, slab_size, slab_thickness}}, {"edge", {slab_size / n}}});
}

Matrix3 rotation_about(int axis, double degrees) {
    const SineCosine at = sine_cosine_of_degrees(degrees);
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    Matrix3 rotation = Matrix3::Identity();
    rotation(u, u) = at.cosine;
    rotation(u, v) = -at.sine;
    rotation(v, u) = at.sine;
    rotation(v, v) = at.cosine;
    return rotation;
}

/// Both jaws, one after the other, then the shaft, each in its own frame; the first `jaw_vertices` belong to the first
/// jaw and as many to the second.
Surface instrument_parts(double edge, Index& jaw_vertices) {
    const Surface jaw = make_shape("jaw", {{"radius", {jaw_radius}}, {"length", {jaw_length}}, {"edge", {edge}}});
    const Surface shaft =
        make_shape("shaft", {{"radius", {shaft_radius}}, {"length", {shaft_length}}, {"edge", {edge}}});
    jaw_vertices = static_cast<Index>(jaw.vertices.cols());
    Surface parts;
    parts.vertices.resize(3, 2 * jaw.vertices.cols() + shaft.vertices.cols());
    parts.triangles.resize(3, 2 * jaw.triangles.cols() + shaft.triangles.cols());
    parts.vertices << jaw.vertices, jaw.vertices, shaft.vertices;
    parts.triangles << jaw.triangles, (jaw.triangles.array() + jaw_vertices).matrix(),
        (shaft.triangles.array() + 2 * jaw_vertices).matrix();
    return parts;
}

/// Rotation of a jaw that opens by `degrees`: pointing down from the hinge, flat faces towards each other.
Matrix3 jaw_rotation(int jaw, double degrees) {
    if (jaw == 1) return rotation_about(0, 180.0 - degrees);
    return rotation_about(0, degrees) * rotation_about(1, 180.0);
}

/// How the instrument is held: angle between the shaft and the vertical, height of the tip's centre above z = 0.
struct Hold {
    double lean_degrees = 0.0;
    double tip_height = 0.0;  ///< m
};

Hold hold_of(const InstrumentInTissueSpec& spec) {
    switch (spec.variant) {
        case Variant::deep:
            return {89.0, -0.0005};
        case Variant::near:
            return {65.0, 0.0035};
        case Variant::far:
            return {65.0, 0.1};
        default:
            break;
    }
    // A 2k instrument shall have 170 to 255 true pairs: the finer the tissue, the less of it may dip in (found by
    // counting, held by a test).
    if (spec.tissue_triangles < 6000) return {84.0, -0.001};
    if (spec.tissue_triangles < 60000) return {80.0, -0.001};
    if (spec.tissue_triangles < 450000) return {70.0, -0.00075};
    return {45.0, -0.00075};
}

double phase_degrees(std::int64_t step) { return 360.0 / motion_period * static_cast<double>(step % 64); }

/// Short triangle counts: 500, 20k, 1M.
std::string short_count(std::int64_t count) {
    if (count >= 1000000 && count % 1000000 == 0) return fmt::format("{}M", count / 1000000);
    if (count >= 1000 && count % 1000 == 0) return fmt::format("{}k", count / 1000);
    return fmt::format("{}", count);
}

/// Entry k: the vertex's number before.
std::vector<Index> reorder(VertexOrder order, Random& random, Surface& surface) {
    if (order == VertexOrder::renumbered) return renumber_along_curve(surface);
    if (order == VertexOrder::shuffled) return shuffle(surface, random);
    std::vector<Index> same(static_cast<std::size_t>(surface.vertices.cols()));
    std::iota(same.begin(), same.end(), 0);
    return same;
}

void finish_frame(std::int64_t step, Frame& frame) {
    constexpr double dt = GeneratedScene::dt;
    frame.tick = step;
    frame.time = static_cast<double>(step) * dt;
    frame.velocity = (frame.position - frame.previous) / dt;
    frame.moved.reset();
    frame.pose.clear();
}

/// Positions of `step` and of the step before, the latter taken over where the frame already holds it.
template <typename Place>
void write_positions(std::int64_t step, Index vertex_count, Place place, Frame& frame) {
    const bool follows = frame.tick + 1 == step && frame.position.cols() == vertex_count;
    frame.previous.resize(3, vertex_count);
    if (follows) {
        frame.previous.swap(frame.position);
    } else if (step > 0) {
        place(step - 1, frame.previous);
    }
    frame.position.resize(3, vertex_count);
    place(step, frame.position);
    if (step == 0) frame.previous = frame.position;
}

}  // namespace

std::string_view name_of(Variant variant) {
    constexpr std::array<std::string_view, 7> names{"light", "deep", "near", "far", "rotating", "strain", "local"};
    return names.at(static_cast<std::size_t>(variant));
}

std::string_view name_of(VertexOrder order) {
    constexpr std::array<std::string_view, 3> names{"renumbered", "generated", "shuffled"};
    return names.at(static_cast<std::size_t>(order));
}

std::string InstrumentInTissueSpec::name() const {
    const bool many = tissues > 1 || instruments > 1;
    std::string text = many ? fmt::format("{} {} x {} + {} x {}", name_of(variant), tissues,
                                          short_count(tissue_triangles), instruments, short_count(instrument_triangles))
                            : fmt::format("{} {} x {}", name_of(variant), short_count(tissue_triangles),
                                          short_count(instrument_triangles));
    if (order != VertexOrder::renumbered) text += fmt::format(" {}", name_of(order));
    return text;
}

InstrumentInTissue::InstrumentInTissue(const InstrumentInTissueSpec& spec) : spec_(spec) {
    Random random(spec.seed);
    std::vector<Body> bodies;

    // Instruments first: bodies are sorted by kind.
    Index jaw_vertices = 0;
    const Surface parts = instrument_parts(
        edge_for(spec.instrument_triangles, [&](double edge) { return instrument_parts(edge, jaw_vertices); }),
        jaw_vertices);
    for (Index i = 0; i < spec.instruments; ++i) {
        Surface surface = parts;
        // Numbered in the closed pose, so that neighbours in space are neighbours in number; moved in their own frames.
        for (Index v = 0; v < surface.vertices.cols(); ++v) {
            if (v < 2 * jaw_vertices) {
                surface.vertices.col(v) = jaw_rotation(v < jaw_vertices ? 1 : 2, 0.0) * parts.vertices.col(v);
            }
            surface.vertices(2, v) += jaw_length;
        }
        Instrument instrument;
        instrument.vertices.count = static_cast<Index>(surface.vertices.cols());
        instrument.rest.resize(3, surface.vertices.cols());
        for (const Index before : reorder(spec.order, random, surface)) {
            const auto v = static_cast<Eigen::Index>(instrument.part.size());
            instrument.part.push_back(before < jaw_vertices ? 1 : before < 2 * jaw_vertices ? 2 : 0);
            instrument.rest.col(v) = parts.vertices.col(before);
        }
        const Index tissue = i % spec.tissues;
        const bool second = i >= spec.tissues;
        const bool alone = spec.instruments <= spec.tissues;
        instrument.yaw_degrees = spec.tissues == 1 && alone ? 0.0 : second ? -90.0 : 90.0;
        instrument.tip = Vector3(slab_pitch * tissue, 0.0, hold_of(spec).tip_height);
        // The tip starts off-centre, so that what dips in stays inside the slab.
        const double start = spec.variant == Variant::near || spec.variant == Variant::far ? 0.0 : -0.03;
        if (instrument.yaw_degrees == 0.0) {
            instrument.tip.x() += start;
        } else {
            instrument.tip.y() += second ? -start : start;
            if (!alone) instrument.tip.x() += second ? 0.02 : -0.02;
        }
        bodies.push_back({.name = fmt::format("instrument_{}", i),
                          .kind = BodyKind::instrument,
                          .instrument = fmt::format("instrument_{}", i),
                          .vertex_count = instrument.vertices.count,
                          .triangles = surface.triangles});
        instruments_.push_back(std::move(instrument));
    }

    const Surface slab = make_slab(spec.tissue_triangles);
    tissue_edge_ = mean_edge(slab.triangles, slab.vertices, {0, static_cast<Index>(slab.triangles.cols())});
    for (Index i = 0; i < spec.tissues; ++i) {
        Surface surface = slab;
        // Real meshes are not lattices: vertices are shaken by a tenth of an edge.
        for (double& x : surface.vertices.reshaped()) x += 0.1 * tissue_edge_ * random.signed_unit();
        surface.vertices.row(2).array() -= 0.5 * slab_thickness;
        reorder(spec.order, random, surface);
        Tissue tissue;
        tissue.vertices.count = static_cast<Index>(surface.vertices.cols());
        if (spec.variant == Variant::near) {
            surface.vertices.row(2) += hollow * surface.vertices.topRows<2>().colwise().squaredNorm();
        }
        tissue.wave.resize(4, surface.vertices.cols());
        for (Index v = 0; v < surface.vertices.cols(); ++v) {
            const SineCosine along_x = sine_cosine_of_degrees(360.0 / wave_length * surface.vertices(0, v));
            const SineCosine along_y = sine_cosine_of_degrees(360.0 / wave_length * surface.vertices(1, v));
            tissue.wave.col(v) << along_x.sine, along_x.cosine, along_y.sine, along_y.cosine;
        }
        surface.vertices.row(0).array() += slab_pitch * i;
        tissue.rest = surface.vertices;
        bodies.push_back({.name = fmt::format("tissue_{}", i),
                          .kind = BodyKind::tissue,
                          .vertex_count = tissue.vertices.count,
                          .triangles = surface.triangles});
        tissues_.push_back(std::move(tissue));
    }
    topology_ = make_topology(bodies);
    for (std::size_t i = 0; i < instruments_.size(); ++i) instruments_[i].vertices = topology_.bodies[i].vertices;
    for (std::size_t i = 0; i < tissues_.size(); ++i) {
        tissues_[i].vertices = topology_.bodies[instruments_.size() + i].vertices;
    }
    if (spec.variant != Variant::local) return;
    for (const Instrument& instrument : instruments_) moved_.push_back(instrument.vertices);
    for (Tissue& tissue : tissues_) {
        for (Index v = 0; v < tissue.vertices.count; ++v) {
            double nearest = local_radius * local_radius;
            for (const Instrument& instrument : instruments_) {
                nearest = std::min(nearest, (tissue.rest.col(v) - contact_centre(instrument)).squaredNorm());
            }
            const double weight = 1.0 - nearest / (local_radius * local_radius);
            if (!(weight > 0.0)) continue;
            tissue.local.push_back(v);
            tissue.weight.push_back(weight * weight);
            const Index number = tissue.vertices.first + v;
            // Ranges that nearly meet are one: a range costs more than a few vertices in it.
            constexpr Index gap = 16;
            if (moved_.back().end() + gap >= number && moved_.back().first >= tissue.vertices.first) {
                moved_.back().count = number + 1 - moved_.back().first;
            } else {
                moved_.push_back({number, 1});
            }
        }
    }
}

Vector3 InstrumentInTissue::contact_centre(const Instrument& instrument) const {
    // Half-way along what lies under the surface, at the surface.
    const SineCosine lean = sine_cosine_of_degrees(hold_of(spec_).lean_degrees);
    const SineCosine yaw = sine_cosine_of_degrees(instrument.yaw_degrees);
    const double extent = -0.5 * instrument.tip.z() * lean.sine / lean.cosine;
    return {instrument.tip.x() + extent * yaw.cosine, instrument.tip.y() + extent * yaw.sine, 0.0};
}

void InstrumentInTissue::place_tissue(const Tissue& tissue, std::int64_t step, Matrix3X& position) const {
    const SineCosine now = sine_cosine_of_degrees(phase_degrees(step));
    auto target = position.middleCols(tissue.vertices.first, tissue.vertices.count);
    if (spec_.variant == Variant::local) {
        for (std::size_t i = 0; i < tissue.local.size(); ++i) {
            // Pressed in and let go, and drawn a little along x.
            const Index v = tissue.local[i];
            target(2, v) = tissue.rest(2, v) - wave_height * tissue.weight[i] * (1.0 + now.sine);
            target(0, v) = tissue.rest(0, v) + wave_height * tissue.weight[i] * now.cosine;
        }
        return;
    }
    // Two travelling waves whose points go round in circles, so that every coordinate changes every step.
    const double stretch = spec_.variant == Variant::strain ? 1.0 + 0.1 * (1.0 - now.cosine) : 1.0;
    const double narrowing = 1.0 / std::sqrt(stretch);
    const double middle = slab_pitch * static_cast<double>(&tissue - tissues_.data());
    for (Index v = 0; v < tissue.vertices.count; ++v) {
        const double sine_x = tissue.wave(0, v) * now.cosine + tissue.wave(1, v) * now.sine;
        const double cosine_x = tissue.wave(1, v) * now.cosine - tissue.wave(0, v) * now.sine;
        const double sine_y = tissue.wave(2, v) * now.cosine + tissue.wave(3, v) * now.sine;
        const double cosine_y = tissue.wave(3, v) * now.cosine - tissue.wave(2, v) * now.sine;
        target(0, v) = middle + (tissue.rest(0, v) - middle) * stretch + wave_height * cosine_x;
        target(1, v) = tissue.rest(1, v) * narrowing + wave_height * cosine_y;
        target(2, v) = tissue.rest(2, v) * narrowing + 0.5 * wave_height * (sine_x + sine_y);
    }
}

void InstrumentInTissue::place_instrument(const Instrument& instrument, std::int64_t step, Matrix3X& position) const {
    const SineCosine now = sine_cosine_of_degrees(phase_degrees(step));
    const double opening = jaw_opening * (1.0 + 0.25 * now.sine);
    const std::array<Matrix3, 2> jaw{jaw_rotation(1, opening), jaw_rotation(2, opening)};
    const double turn = spec_.variant == Variant::rotating ? 5.0 * static_cast<double>(step % 72) : 2.0 * now.cosine;
    const Matrix3 pose = rotation_about(2, instrument.yaw_degrees) * rotation_about(1, hold_of(spec_).lean_degrees) *
                         rotation_about(2, turn);
    // The tip goes round in a circle of 0.2 mm across the surface and 0.1 mm through it.
    const Vector3 tip = instrument.tip + 0.0002 * Vector3(now.cosine, now.sine, 0.5 * now.sine);
    auto target = position.middleCols(instrument.vertices.first, instrument.vertices.count);
    const Vector3 hinge(0.0, 0.0, jaw_length);
    for (Index v = 0; v < instrument.vertices.count; ++v) {
        Vector3 p = instrument.rest.col(v);
        const std::uint8_t part = instrument.part[static_cast<std::size_t>(v)];
        if (part > 0) p = jaw.at(part - 1U) * p;
        target.col(v) = pose * (p + hinge) + tip;
    }
}

void InstrumentInTissue::place_at_rest(Matrix3X& position) const {
    for (const Tissue& tissue : tissues_) {
        position.middleCols(tissue.vertices.first, tissue.vertices.count) = tissue.rest;
    }
}

/// Of variant local only what moves.
void InstrumentInTissue::place(std::int64_t step, Matrix3X& position) const {
    for (const Instrument& instrument : instruments_) place_instrument(instrument, step, position);
    for (const Tissue& tissue : tissues_) place_tissue(tissue, step, position);
}

/// Variant local: only what moves is written, as a solver with an active region does; the rest stays in no cache.
void InstrumentInTissue::write_moved(std::int64_t step, Frame& frame) const {
    frame.previous.swap(frame.position);
    place(step, frame.position);
    for (const Range& range : moved_) {
        frame.velocity.middleCols(range.first, range.count) = (frame.position.middleCols(range.first, range.count) -
                                                               frame.previous.middleCols(range.first, range.count)) /
                                                              dt;
    }
    frame.tick = step;
    frame.time = static_cast<double>(step) * dt;
}

void InstrumentInTissue::write(std::int64_t step, Frame& frame) const {
    const bool follows = frame.tick > 0 && frame.tick + 1 == step && frame.moved.has_value() &&
                         *frame.moved == moved_ && frame.position.cols() == topology_.vertex_count;
    if (spec_.variant == Variant::local && follows) {
        write_moved(step, frame);
        return;
    }
    write_positions(
        step, topology_.vertex_count,
        [this](std::int64_t at, Matrix3X& position) {
            if (spec_.variant == Variant::local) place_at_rest(position);
            place(at, position);
        },
        frame);
    finish_frame(step, frame);
    if (spec_.variant == Variant::local && step > 0) frame.moved = moved_;
}

Balls::Balls(Index count, Index triangles, std::uint64_t seed) {
    constexpr double radius = 0.01;
    const auto make = [](double edge) { return make_shape("sphere", {{"radius", {radius}}, {"edge", {edge}}}); };
    const Surface ball = make(edge_for(triangles, make));
    ball_ = ball.vertices;
    Random random(seed);
    std::vector<Body> bodies;
    const auto side = static_cast<Index>(std::ceil(std::cbrt(static_cast<double>(count)) - 1e-9));
    for (Index i = 0; i < count; ++i) {
        const Index layer = i / (side * side);
        const Index row = (i / side) % side;
        const Vector3 cell(i % side, row, layer);
        // Neighbours along x overlap by 4 % of a diameter, the others keep clear of each other.
        centre_.push_back(2.0 * radius * cell.cwiseProduct(Vector3(0.96, 1.15, 1.15)));
        // The order of a call's arguments differs between compilers, so that each is drawn by itself, z first.
        Vector3 wobble;
        for (int axis = 2; axis >= 0; --axis) wobble[axis] = random.signed_unit();
        wobble_.push_back(180.0 * wobble);
        bodies.push_back({.name = fmt::format("ball_{}", i),
                          .kind = BodyKind::tissue,
                          .vertex_count = static_cast<Index>(ball_.cols()),
                          .triangles = ball.triangles});
    }
    topology_ = make_topology(bodies);
}

void Balls::place(std::int64_t step, Matrix3X& position) const {
    const double phase = phase_degrees(step);
    for (std::size_t i = 0; i < centre_.size(); ++i) {
        Vector3 axes;
        for (int axis = 0; axis < 3; ++axis) {
            axes[axis] = 1.0 + 0.02 * sine_cosine_of_degrees(phase + wobble_[i][axis]).sine;
        }
        const Matrix3 pose =
            rotation_about(2, wobble_[i][0]) * rotation_about(0, wobble_[i][1] + 2.0 * axes[2]) * axes.asDiagonal();
        position.middleCols(topology_.bodies[i].vertices.first, ball_.cols()) = (pose * ball_).colwise() + centre_[i];
    }
}

void Balls::write(std::int64_t step, Frame& frame) const {
    write_positions(
        step, topology_.vertex_count, [this](std::int64_t at, Matrix3X& position) { place(at, position); }, frame);
    finish_frame(step, frame);
}

namespace {

constexpr const char* instrument_in_tissue = "instrument_in_tissue";
constexpr const char* balls = "balls";

template <typename Enum, std::size_t count>
Enum value_named(const std::string& text) {
    for (std::size_t i = 0; i < count; ++i) {
        if (name_of(static_cast<Enum>(i)) == text) return static_cast<Enum>(i);
    }
    return {};
}

template <typename Enum, std::size_t count>
std::vector<std::string> value_names() {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < count; ++i) names.emplace_back(name_of(static_cast<Enum>(i)));
    return names;
}

constexpr std::size_t variant_count = 7;
constexpr std::size_t order_count = 3;
constexpr double largest_count = 1e8;  ///< size_limits.hpp refuses less, unless lifted

void expect_at_most(std::int64_t most, const std::string& of_what, std::int64_t count) {
    if (are_sizes_limited() && count > most) {
        throw InputError("generated scene", "", limit_text(most, of_what), fmt::format("{}", count));
    }
}

/// The checked text.
struct Given {
    std::string text;
    const GeneratedSceneEntry* entry;
    ParameterValues values;
    [[nodiscard]] Index integer(const char* key) const { return static_cast<Index>(values.integer(key)); }
};

Given checked(const std::string& text) {
    const MethodSpec spec = parse_method(text);
    std::vector<std::string> names;
    for (const GeneratedSceneEntry& entry : generated_scenes()) {
        names.push_back(entry.name);
        if (entry.name == spec.name) return {spec.text(), &entry, checked_values(entry, spec.parameters)};
    }
    throw InputError("generated scene", "", fmt::format("{}", fmt::join(names, " or ")), "'" + spec.name + "'");
}

InstrumentInTissueSpec spec_of(const Given& given, std::uint64_t seed) {
    const InstrumentInTissueSpec spec{.variant = value_named<Variant, variant_count>(given.values.text("variant")),
                                      .tissue_triangles = given.integer("tissue_triangles"),
                                      .instrument_triangles = given.integer("instrument_triangles"),
                                      .tissues = given.integer("tissues"),
                                      .instruments = given.integer("instruments"),
                                      .order = value_named<VertexOrder, order_count>(given.values.text("order")),
                                      .seed = seed};
    if (spec.instruments > 2 * spec.tissues) {
        throw InputError("generated scene", "instruments", "at most two for each tissue",
                         fmt::format("{} for {}", spec.instruments, spec.tissues));
    }
    return spec;
}

/// "light, instrument 2k": what scenes that differ in the size of the tissue have in common.
std::string family_of(const InstrumentInTissueSpec& spec) {
    std::string text = fmt::format("{}, instrument {}", name_of(spec.variant), short_count(spec.instrument_triangles));
    if (spec.tissues > 1) text += fmt::format(", {} tissues, {} instruments", spec.tissues, spec.instruments);
    if (spec.order != VertexOrder::renumbered) text += fmt::format(", {}", name_of(spec.order));
    return text;
}

}  // namespace

const std::vector<GeneratedSceneEntry>& generated_scenes() {
    static const std::vector<GeneratedSceneEntry> entries{
        {instrument_in_tissue,
         "Instruments of a shaft and two jaws in slabs of tissue",
         {choice_parameter("variant", "light", value_names<Variant, variant_count>(),
                           "light or deep contact, near or far, rotating, strained by 20 %, deforming locally"),
          integer_parameter("tissue_triangles", "20000", 100, largest_count, "of each tissue"),
          integer_parameter("instrument_triangles", "2000", 100, largest_count, "of each instrument"),
          integer_parameter("tissues", "1", 1, 100, "number of slabs"),
          integer_parameter("instruments", "1", 0, 200, "number of instruments, at most two for each tissue"),
          choice_parameter("order", "renumbered", value_names<VertexOrder, order_count>(),
                           "numbering of vertices and triangles")}},
        {balls,
         "Deforming spheres on a lattice, each overlapping its neighbours along one axis",
         {integer_parameter("count", "16", 2, 100000, "number of spheres"),
          integer_parameter("triangles", "320", 20, largest_count, "of each sphere")}}};
    return entries;
}

GeneratedSceneFacts generated_scene_facts(const std::string& text) {
    const Given given = checked(text);
    if (given.entry->name == balls) {
        const Index count = given.integer("count");
        const Index triangles = given.integer("triangles");
        constexpr Index usual_triangles = 320;
        expect_at_most(most_bodies, "bodies", count);
        expect_at_most(most_triangles, "triangles", static_cast<std::int64_t>(count) * triangles);
        const std::string size = triangles == usual_triangles ? "" : " of " + short_count(triangles);
        return {.text = given.text,
                .name = fmt::format("{} balls{}", count, size),
                .family = balls + size,
                .pair_class = "T2T",
                .triangles = static_cast<std::int64_t>(count) * triangles};
    }
    const InstrumentInTissueSpec spec = spec_of(given, 1);
    const std::int64_t triangles = static_cast<std::int64_t>(spec.tissues) * spec.tissue_triangles +
                                   static_cast<std::int64_t>(spec.instruments) * spec.instrument_triangles;
    expect_at_most(most_triangles, "triangles", triangles);
    return {.text = given.text,
            .name = spec.name(),
            .family = family_of(spec),
            .pair_class = "I2T",
            .triangles = triangles};
}

std::unique_ptr<GeneratedScene> make_generated_scene(const std::string& text, std::uint64_t seed) {
    (void)generated_scene_facts(text);  // checks the size
    const Given given = checked(text);
    if (given.entry->name == balls) {
        return std::make_unique<Balls>(given.integer("count"), given.integer("triangles"), seed);
    }
    return std::make_unique<InstrumentInTissue>(spec_of(given, seed));
}

}  // namespace trocar
