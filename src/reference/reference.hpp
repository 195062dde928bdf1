// The stored reference of a closed-loop scene (STUDIES "Reference for the closed loop"): what force and motion an
// implicit solver of the same springs found, once with hard contact and once with contact as stiff as the scene says,
// with how well it knows them; and the errors of a run against it. Reads no detector, response or contact.
//
// Figures that every closed-loop record carries in its summary (NaN = no reference, see environment
// "reference.hard" and "reference.equal_k"):
//   force_error_rms_equal_k, force_error_worst_equal_k: N, tool force below 30 Hz, length of the vector difference
//   impulse_error_worst_equal_k: N s, per 10 ms, length of the vector difference
//   position_error_rms_equal_k, position_error_worst_equal_k: m, of the stored tissue vertices or operators
//   force_bound_equal_k: N, how far the reference itself may be off
// the same six with _hard in place of _equal_k, and
//   reference_clears_hard: 1 the hard reference stays within the strain limit, 0 not; known also for scenes whose
//   force has no reference
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "scene/scene.hpp"

namespace trocar {

/// What one refinement changed: the differences between its three finest runs, first the two coarser ones, then the two
/// finer ones, and what counts as none.
struct Refinement {
    static constexpr double unset = std::numeric_limits<double>::quiet_NaN();
    std::array<double, 2> force{unset, unset};     ///< N, RMS below 30 Hz
    std::array<double, 2> impulse{unset, unset};   ///< N s, largest per 10 ms
    std::array<double, 2> position{unset, unset};  ///< m, largest of the stored points
    double force_floor = unset;                    ///< N: differences of force up to this count as none
};

/// One solved law of contact: hard, or an elastic foundation of the scene's stiffness or of the one that a study's knob
/// puts in its place.
struct ReferenceSolution {
    static constexpr double unset = std::numeric_limits<double>::quiet_NaN();
    bool available = false;
    std::string reason;        ///< why there is none, or why it ends before the scene does
    double until = unset;      ///< s; valid for times up to this
    double time_step = unset;  ///< s, of the finest solution, the one stored; smaller where the motion is sudden
    double residual = unset;   ///< largest unbalanced force over the largest contact force, over all steps
    double worst_gap = unset;  ///< m, smallest gap at the end of a step; negative = penetration
    double rest_gap = unset;   ///< m, hard: distance below which surfaces repel; equal k: NaN
    /// Observed orders from three steps and three stiffnesses (hard: repelling distances), halved one at a time; NaN
    /// where the differences do not shrink.
    double order_time_step = unset;
    double order_stiffness = unset;
    Refinement by_time_step;
    Refinement by_stiffness;
    double force_bound = unset;      ///< N, RMS below 30 Hz: what is left by both refinements together
    double impulse_bound = unset;    ///< N s, largest per 10 ms
    double position_bound = unset;   ///< m, largest
    double max_strain = unset;       ///< largest edge strain over the run
    double max_strain_time = unset;  ///< s, when that was
    double final_strain = unset;     ///< largest edge strain at the end of the run
    /// Hard: no gap closes and no edge is longer than the strain limit allows, at any time. Known also where the force
    /// has no reference: whenever the run came to the end of the scene or over the limit, and all refinements agree.
    std::optional<bool> clears_within_strain_limit;
    std::array<double, 2> strain_range{unset, unset};  ///< least and largest of max_strain over all refinements
    double sample_interval = unset;                    ///< s
    Matrix3X force;                    ///< 3×S, N, on the shown body at times 0, interval, 2 interval …
    double position_interval = unset;  ///< s
    std::vector<Index> points;         ///< vertices whose places are stored
    std::vector<Matrix3X> positions;   ///< one 3×points matrix per position_interval, m, world

    /// Linear between samples; the last one is held.
    [[nodiscard]] Vector3 force_at(double time) const;
    [[nodiscard]] Matrix3X positions_at(double time) const;
};

struct Reference {
    std::string scene;
    std::string scene_hash;                      ///< 16 hex digits of Scene::hash
    double turned_k = ReferenceSolution::unset;  ///< N/m, Scene::turned_k; then it holds equal k alone
    std::map<std::string, std::string> origin;   ///< commit, command, solver settings, seed
    ReferenceSolution hard;
    ReferenceSolution equal_k;
};

/// Where the reference of a scene file is kept: reference/NAME.json beside it, or reference/NAME.k=VALUE.json for
/// another contact stiffness than the file's.
std::filesystem::path reference_file(const std::filesystem::path& scene_file,
                                     double turned_k = ReferenceSolution::unset);

/// Throws InputError with file and JSON pointer.
Reference read_reference(const std::filesystem::path& file);
std::string to_json(const Reference& reference);

enum class ReferenceState : std::uint8_t { present, missing, stale };
struct FoundReference {
    ReferenceState state = ReferenceState::missing;  ///< of the file for the scene's contact stiffness
    Reference reference;                             ///< a law of which no file fits is not available, for that reason
    /// One line: both laws as text_of reports them.
    [[nodiscard]] std::string message() const;
};
/// The reference of the scene, looked up beside its file and held against its hash: one made for another state of the
/// scene is stale and not given. Of a scene of turned k, equal k comes from that k's file and hard contact, which has
/// no stiffness, from the scene's own.
FoundReference find_reference(const Scene& scene);
/// What a report reports a law, in a clause: orders and bound, or why there is no reference.
std::string text_of(const ReferenceSolution& solution);

/// Follows one run and reports its errors against the reference.
class ReferenceComparison {
public:
    /// `found` outlives the object. dt: tick of the run, s.
    ReferenceComparison(const FoundReference& found, double dt);
    /// One tick: its time, the force on the shown body (mean over the tick, N) and all positions after it.
    void observe(double time, const Vector3& tool_force, const Matrix3X& position);
    /// The thirteen figures named at the top of this file.
    [[nodiscard]] std::map<std::string, double> figures() const;

private:
    struct Law {
        const ReferenceSolution* solution = nullptr;  ///< null = no reference
        std::vector<Vector3> force_difference;
        double position_squares = 0.0;
        double position_count = 0.0;
        double position_worst = 0.0;
    };
    double dt_;
    double clears_ = ReferenceSolution::unset;
    std::array<Law, 2> laws_;  ///< equal k, hard
};

/// Zero-phase low-pass: a second-order Butterworth of `cutoff` Hz forward and backward, started and ended at rest at
/// the first and last value. Samples `dt` s apart.
std::vector<Vector3> low_pass(const std::vector<Vector3>& samples, double dt, double cutoff);

inline constexpr double force_band_hz = 30.0;   ///< STUDIES: force is compared below this
inline constexpr double impulse_window = 0.01;  ///< s

}  // namespace trocar
