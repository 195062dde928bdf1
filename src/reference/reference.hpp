// Stored reference of a closed-loop scene (STUDIES "Reference for the closed loop"), and the errors of a run against
// it. Holds force and motion from an implicit solver of the same springs, with hard contact and with the scene's
// contact stiffness, and their error bounds. Uses no detector, response or contact.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "scene/scene.hpp"

namespace trocar {

/// ResponseOutput of one refinement: the differences between its three finest runs, first of the two coarser, then of
/// the two finer ones.
struct Refinement {
    std::array<double, 2> force{not_known, not_known};     ///< N, RMS below 30 Hz
    std::array<double, 2> impulse{not_known, not_known};   ///< N s, largest per 10 ms
    std::array<double, 2> position{not_known, not_known};  ///< m, largest of the stored points
    double force_floor = not_known;                        ///< N: differences of force up to this count as zero
};

/// Solution of one contact law: hard, or an elastic foundation with the stiffness of the scene or of a study's
/// parameter.
struct ReferenceSolution {
    bool available = false;
    std::string reason;            ///< reason for no solution, or for an end before the scene's
    double until = not_known;      ///< s; valid for times up to this
    double time_step = not_known;  ///< s, of the stored, finest solution; smaller for sudden motion
    double residual = not_known;   ///< largest unbalanced force over the largest contact force, over all steps
    double worst_gap = not_known;  ///< m, smallest gap at the end of a step; negative = penetration
    double rest_gap = not_known;   ///< m, hard: distance below which surfaces repel; equal k: NaN
    /// Observed orders from three steps and three stiffnesses (hard: repelling distances), halved one at a time. NaN
    /// where the differences do not shrink.
    double order_time_step = not_known;
    double order_stiffness = not_known;
    Refinement by_time_step;
    Refinement by_stiffness;
    double force_bound = not_known;      ///< N, RMS below 30 Hz: remaining error of both refinements
    double impulse_bound = not_known;    ///< N s, largest per 10 ms
    double position_bound = not_known;   ///< m, largest
    double max_strain = not_known;       ///< largest edge strain over the run
    double max_strain_time = not_known;  ///< s, time of max_strain
    double final_strain = not_known;     ///< largest edge strain at the end of the run
    /// Hard: no gap closes and no edge exceeds the strain limit at any time. Known without a force reference if the run
    /// reached the end of the scene or exceeded the limit, and all refinements agree.
    std::optional<bool> clears_within_strain_limit;
    std::array<double, 2> strain_range{not_known, not_known};  ///< smallest and largest max_strain of all refinements
    double sample_interval = not_known;                        ///< s
    Matrix3X force;                        ///< 3×S, N, on the shown body at times 0, interval, 2 interval …
    double position_interval = not_known;  ///< s
    std::vector<Index> points;             ///< vertices with stored positions
    std::vector<Matrix3X> positions;       ///< one 3×points matrix per position_interval, m, world

    /// Linear between samples; constant after the last one.
    [[nodiscard]] Vector3 force_at(double time) const;
    [[nodiscard]] Matrix3X positions_at(double time) const;
};

struct Reference {
    std::string scene;
    std::string scene_hash;                     ///< 16 hex digits of Scene::hash
    double turned_k = not_known;                ///< N/m, Scene::turned_k; if set, only equal k is available
    std::map<std::string, std::string> origin;  ///< commit, command, solver settings, seed
    ReferenceSolution hard;
    ReferenceSolution equal_k;
};

/// Path of a scene's reference: reference/NAME.json beside the scene file, or reference/NAME.k=VALUE.json for a contact
/// stiffness other than the file's.
std::filesystem::path reference_file(const std::filesystem::path& scene_file, double turned_k = not_known);

/// Hash over the references of a scene, of all contact stiffnesses; empty without one.
std::string hash_of_references(const std::filesystem::path& scene_file);

/// Throws InputError with file and JSON pointer.
Reference read_reference(const std::filesystem::path& file);
std::string to_json(const Reference& reference);

enum class ReferenceState : std::uint8_t { present, missing, stale };
struct FoundReference {
    ReferenceState state = ReferenceState::missing;  ///< of the file for the scene's contact stiffness
    Reference reference;                             ///< a law without a matching file is unavailable, with the reason
    /// One line: text_of both laws.
    [[nodiscard]] std::string message() const;
};
/// Finds the reference beside the scene's file and compares its hash. A reference of another version of the scene is
/// stale and not returned. With turned_k, equal k comes from that k's file and hard contact from the scene's own.
FoundReference find_reference(const Scene& scene);
/// A report's clause on one law: orders and bound, or the reason for no reference.
std::string text_of(const ReferenceSolution& solution);

/// Errors of one run against the reference; NaN without one (environment "reference.equal_k", "reference.hard"). Forces
/// are below 30 Hz, and differences are lengths of vectors.
struct ReferenceErrors {
    struct Law {
        double force_rms = not_known;       ///< N
        double force_worst = not_known;     ///< N
        double impulse_worst = not_known;   ///< N s, over 10 ms
        double position_rms = not_known;    ///< m, of the stored tissue vertices or operators
        double position_worst = not_known;  ///< m
        double force_bound = not_known;     ///< N, root mean square, of the reference itself
        double position_bound = not_known;  ///< m, largest, of the reference itself
        double reference_max = not_known;   ///< N, largest force of the reference itself, at the run's ticks
        double reference_step = not_known;  ///< N, its largest change from tick to tick, the first from zero
    };
    Law equal_k;
    Law hard;
    double hard_clears = not_known;  ///< 1: within the strain limit, 0: not; known without forces too
};

/// Accumulates the errors of one run against the reference.
class ReferenceComparison {
public:
    /// `found` outlives the object. dt: tick of the run, s.
    ReferenceComparison(const FoundReference& found, double dt);
    /// Adds one tick: its time (s), mean force over the tick on the shown body (N) and all positions after it (3×N, m).
    void observe(double time, const Vector3& tool_force, const Matrix3X& position);
    [[nodiscard]] ReferenceErrors errors() const;

private:
    struct Law {
        const ReferenceSolution* solution = nullptr;  ///< null = no reference
        std::vector<Vector3> force_difference;
        Vector3 force = Vector3::Zero();  ///< of the solution at the last tick
        double force_max = 0.0;
        double force_step = 0.0;
        double position_squares = 0.0;
        double position_count = 0.0;
        double position_worst = 0.0;
    };
    double dt_;
    double clears_ = not_known;
    std::array<Law, 2> laws_;  ///< equal k, hard
};

/// Zero-phase low-pass: a second-order Butterworth of `cutoff` Hz, forward and backward, in steady state at the first
/// and last value. Samples are `dt` s apart.
std::vector<Vector3> low_pass(const std::vector<Vector3>& samples, double dt, double cutoff);

inline constexpr double force_band_hz = 30.0;   ///< Hz, STUDIES: forces are compared below it
inline constexpr double impulse_window = 0.01;  ///< s, window of the impulse errors

/// Size of a course of forces below force_band_hz.
struct ForceSize {
    double rms = 0.0;    ///< N
    double worst = 0.0;  ///< N; NaN where one force is
};
/// Samples are `dt` s apart; there is at least one.
ForceSize force_in_band(const std::vector<Vector3>& samples, double dt);
/// N s, largest over windows of impulse_window; NaN where one force is.
double largest_impulse(const std::vector<Vector3>& samples, double dt);

}  // namespace trocar
