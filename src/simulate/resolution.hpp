// Interpenetration resolution: how a response gets bodies apart that have passed into each other while there was no
// contact. A scene with such an interval is held against its twin, the same scene with contact at every tick. The twin
// shows the state that the response itself calls resolved.
#pragma once

#include <string>
#include <vector>

#include "measure/metric.hpp"
#include "measure/step_row.hpp"
#include "scene/scene.hpp"
#include "simulate/simulation.hpp"

namespace trocar {

/// The scene with contact at every tick. It begins in the clean state that the scripts begin in, so that every tick is
/// Scene::prelude_ticks() later.
Scene twin_of(const Scene& scene);

/// Ticks of the scene in which resolution is judged.
struct ResolutionWindow {
    static constexpr double length = 0.2;  ///< s
    static constexpr double rest = 0.1;    ///< s at the end, for which the scripts stand still

    std::int64_t begin = 0;  ///< first tick with contact after the interval
    std::int64_t rest_begin = 0;
    std::int64_t end = 0;
};
/// The scene has an interval without contact and does not end before the window.
bool has_resolution_window(const Scene& scene);
/// Throws InputError for a scene without one.
ResolutionWindow resolution_window(const Scene& scene);

/// Course of one run in the window.
struct ResolutionTrail {
    struct Tick {
        double depth = 0.0;               ///< m, residual penetration
        double wrong_side_area = 0.0;     ///< m²
        Vector3 force = Vector3::Zero();  ///< N, on the shown instrument
        double energy = 0.0;              ///< J, elastic and kinetic, of tissue above that of the first frame
        double overshoot = 0.0;           ///< m; 0 where no gap counts as one
        double strain_over = 0.0;         ///< 1
        std::int64_t ruptures = 0;
        std::int64_t offered = 0;  ///< contacts, to the response
        std::int64_t used = 0;
    };
    std::vector<Tick> ticks;    ///< of the window, in order; fewer where the run ended before
    Matrix3X mean_position;     ///< m, 3×N, over the rest
    Matrix3X last_position;     ///< m, 3×N, after the last tick of the run
    bool meets = false;         ///< truth knows a pair that meets in the first tick of the window
    double depth_before = 0.0;  ///< m, residual penetration that the interval has left
};

/// Makes the trail of a run, tick by tick.
class ResolutionObserver {
public:
    /// `delay`: ticks by which the run is behind the scene, 0 or, of its twin, Scene::prelude_ticks(). The scene
    /// outlives the object.
    ResolutionObserver(const Scene& scene, std::int64_t delay);

    /// Call after every tick, judged by truth. `depth_before` of the trail is that of the tick before the window; the
    /// caller sets it where there is none.
    void observe(const Simulation& simulation, const StepRow& row);
    [[nodiscard]] const ResolutionTrail& trail() const { return trail_; }

private:
    ResolutionWindow window_;
    std::int64_t delay_ = 0;
    std::int64_t resting_ = 0;  ///< ticks of the rest so far
    ResolutionTrail trail_;
};

/// Why a run has not resolved.
enum class Unresolved : std::uint8_t {
    none,               ///< it has
    unstable,           ///< the outcome is not ok, or strain exceeds the limit
    rupture,            ///< contact tore
    nothing_reported,   ///< at the end of the window the response gets no contact
    no_direction,       ///< it gets contacts and exerts no force
    wrong_side_held,    ///< bodies are kept apart, or pushed, where the twin is not
    too_slow,           ///< the depth still falls
    balance_of_forces,  ///< it stands
};
std::string_view text_of(Unresolved cause);

struct Resolution {
    Summary figures;  ///< the metrics resolution_…
    Unresolved cause = Unresolved::none;
};

/// Compares a run with its twin under the same response. `outcome`: of the run. It has resolved where all of this
/// holds:
/// - From some tick of the window to its end, the depth is at most 0.02 edges more than the twin's largest at rest.
/// - From that tick on, the area on a wrong side is at most one squared edge more, and strain is within the limit.
/// - Over the rest, the mean force differs from the twin's by at most 0.05 N or 25 %.
/// - Over the rest, the mean places of 95 % of the free tissue vertices differ by at most 0.25 edges.
/// - Nothing tears in the window, and both runs reach its end.
/// - The twin at rest is at most half as deep as the interval has left the scene.
/// An edge is the tissue's mean edge; without tissue, the smallest mean edge of a body that moves.
Resolution compare_resolution(const Scene& scene, const Outcome& outcome, const ResolutionTrail& trail,
                              const ResolutionTrail& twin);

}  // namespace trocar
