// Generated scenes for detectors: instruments that move in deforming tissue of any size, or many deforming balls. Equal
// texts give bit-identical scenes on every machine. A frame is a pure function of its step, so that methods that take
// turns read equal frames without storage.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "method/entry.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Bodies and frames of a generated scene.
class GeneratedScene {
public:
    GeneratedScene() = default;
    GeneratedScene(const GeneratedScene&) = delete;
    GeneratedScene& operator=(const GeneratedScene&) = delete;
    GeneratedScene(GeneratedScene&&) = delete;
    GeneratedScene& operator=(GeneratedScene&&) = delete;
    virtual ~GeneratedScene() = default;

    [[nodiscard]] const Topology& topology() const { return topology_; }
    /// Writes positions, previous positions, velocities, tick and time of `step` >= 0. Fastest when `frame` holds the
    /// previous step; the result does not depend on it.
    virtual void write(std::int64_t step, Frame& frame) const = 0;

    static constexpr double dt = 0.001;  ///< s

protected:
    Topology topology_;
};

/// Kind of generated scene: name, settings and meaning, as `trocar list` prints them.
struct GeneratedSceneEntry {
    std::string name;
    std::string meaning;
    std::vector<Parameter> parameters;
};
const std::vector<GeneratedSceneEntry>& generated_scenes();

/// Facts of a generated scene, known before it is made.
struct GeneratedSceneFacts {
    std::string text;            ///< NAME:key=value…, keys in alphabetical order
    std::string name;            ///< "light 20k x 2k", "16 balls"
    std::string family;          ///< scenes of one family differ in size only: "light", "balls"
    std::string pair_class;      ///< "I2T", "T2T"
    std::int64_t triangles = 0;  ///< as asked for; the scene has about as many
};

/// Throws InputError for an unknown name or setting and for a value out of range.
GeneratedSceneFacts generated_scene_facts(const std::string& text);
/// Makes the scene. `seed` decides the irregularity of its meshes. Throws as above.
std::unique_ptr<GeneratedScene> make_generated_scene(const std::string& text, std::uint64_t seed = 1);

/// Motion of the instrument relative to the tissue. Every tissue vertex moves in every step, except in `local`.
enum class Variant : std::uint8_t {
    light,     ///< jaws and part of the shaft dip into the surface: about 200 true pairs with a 2k instrument
    deep,      ///< the instrument lies in the surface along its whole length
    near,      ///< it hovers in a hollow: the boxes of the bodies overlap, no triangles intersect
    far,       ///< it is one slab length away
    rotating,  ///< as light; the instrument turns about its axis by 5 degrees per step
    strain,    ///< as light; the tissue is stretched by up to 20 % relative to the shape at prepare
    local      ///< as light; only the upper side within 8 mm of the contact moves, and the frame lists the moved ranges
};
std::string_view name_of(Variant variant);

/// Numbering of vertices and triangles within each body.
enum class VertexOrder : std::uint8_t {
    renumbered,  ///< along a space-filling curve, once at load
    generated,   ///< as generated, face by face and row by row
    shuffled     ///< random permutation, the worst case
};
std::string_view name_of(VertexOrder order);

/// Settings of InstrumentInTissue.
struct InstrumentInTissueSpec {
    Variant variant = Variant::light;
    Index tissue_triangles = 20000;     ///< per tissue, >= 100; rounded to what the slab's grid allows
    Index instrument_triangles = 2000;  ///< per instrument, >= 100; rounded likewise
    Index tissues = 1;
    Index instruments = 1;  ///< distributed over the tissues in turn, at most two each
    VertexOrder order = VertexOrder::renumbered;
    std::uint64_t seed = 1;

    /// "light 20k x 2k", "light 5 x 20k + 10 x 2k", "light 200k x 2k shuffled".
    [[nodiscard]] std::string name() const;
};

/// Closed slabs of 0.1 × 0.1 × 0.01 m with the top at z = 0, and instruments (shaft and two jaws, 0.12 m long).
class InstrumentInTissue final : public GeneratedScene {
public:
    explicit InstrumentInTissue(const InstrumentInTissueSpec& spec);

    /// m, mean edge of the first tissue at rest.
    [[nodiscard]] double tissue_edge() const { return tissue_edge_; }
    void write(std::int64_t step, Frame& frame) const override;

private:
    /// Rest shape of one tissue, with sines and cosines of two crossing waves at each vertex.
    struct Tissue {
        Range vertices;
        Matrix3X rest;  ///< 3×n, m, world
        Eigen::Array<double, 4, Eigen::Dynamic> wave;
        std::vector<Index> local;  ///< variant local: moving vertices, numbered within the tissue
        std::vector<double> weight;
    };
    struct Instrument {
        Range vertices;
        Matrix3X rest;                   ///< 3×n, m, each part in its local frame
        std::vector<std::uint8_t> part;  ///< 0 shaft, 1 and 2 jaws
        Vector3 tip = Vector3::Zero();   ///< m, world, position of the tip
        double yaw_degrees = 0.0;        ///< about z: direction of the shaft
    };

    [[nodiscard]] Vector3 contact_centre(const Instrument& instrument) const;
    void place_tissue(const Tissue& tissue, std::int64_t step, Matrix3X& position) const;
    void place_instrument(const Instrument& instrument, std::int64_t step, Matrix3X& position) const;
    void place_at_rest(Matrix3X& position) const;
    void place(std::int64_t step, Matrix3X& position) const;
    void write_moved(std::int64_t step, Frame& frame) const;

    InstrumentInTissueSpec spec_;
    double tissue_edge_ = 0.0;
    std::vector<Tissue> tissues_;
    std::vector<Instrument> instruments_;
    std::vector<Range> moved_;  ///< variant local
};

/// Deforming bodies: `count` geodesic spheres of about `triangles` triangles on a cubic lattice. They wobble and
/// overlap slightly with their neighbours along x. All pairs of bodies are tested.
class Balls final : public GeneratedScene {
public:
    Balls(Index count, Index triangles, std::uint64_t seed);
    void write(std::int64_t step, Frame& frame) const override;

private:
    void place(std::int64_t step, Matrix3X& position) const;

    Matrix3X ball_;                ///< 3×n, m, one sphere about the origin
    std::vector<Vector3> centre_;  ///< m
    std::vector<Vector3> wobble_;  ///< degrees, phase per axis
};

}  // namespace trocar
