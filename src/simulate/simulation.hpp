// One run in memory: scene, detector, response and the buffers they share. step() is one tick of DESIGN §5 and fits on
// one page; replay() is the same tick with frames from outside.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "contact/contact_set.hpp"
#include "contact/response_output.hpp"
#include "contact/tip_force.hpp"
#include "measure/step_row.hpp"
#include "method/entry.hpp"
#include "method/registry.hpp"
#include "scene/scene.hpp"

namespace trocar {

/// Margin of the query distance, in mean edges.
inline constexpr double default_query_distance_margin = 0.1;

/// What a run may choose beside its methods.
struct SimulationSettings {
    MethodSpec stepper = {};                                       ///< without a name: the default one
    double query_distance_margin = default_query_distance_margin;  ///< mean edges, see simulate/query_distance.hpp
    TipSettings device = {};  ///< shows the force on the instrument, the same for every response
    /// EnergyMomentumAudit are kept and a tick that has blown up by its contacts ends unstable (blow_up.hpp), outside
    /// the clock.
    bool watched = true;
};

class Simulation {
public:
    /// The scene outlives the simulation. `response` may be null: detection only, bodies follow their scripts and
    /// tissue stays as it is. `source` makes the contacts (Registry::source); one that wants pairs within a query
    /// distance gets them. A response output that the stepper does not take is outcome unsupported. A method that
    /// throws while it is prepared leaves its outcome in outcome(), and every step then fails with it.
    Simulation(const Scene& scene, std::unique_ptr<Detector> detector, std::unique_ptr<Response> response,
               const ContactGeneratorEntry& source, const SimulationSettings& settings = {});
    ~Simulation();
    Simulation(const Simulation&) = delete;
    Simulation& operator=(const Simulation&) = delete;
    Simulation(Simulation&&) = delete;
    Simulation& operator=(Simulation&&) = delete;

    /// Does one tick. The first one is tick 0 and sees the scene's first frame. After a failed outcome the frame stays
    /// as it was. Truth fields of the row stay unset.
    StepRow step();

    /// update, detect and contacts on a frame from outside; the world is not advanced. seen() is then that frame.
    StepRow replay(const Frame& frame);

    [[nodiscard]] const Frame& seen() const;   ///< the frame that detect saw in the last step
    [[nodiscard]] const Frame& frame() const;  ///< the frame after the last step
    /// The same for books of energy and momentum, with what the stepper has left behind where it would be by now
    /// (Stepper::complete); only a simulation that is `watched` knows.
    [[nodiscard]] const Frame& whole_frame() const;
    /// Result of the last detect; contacts.contacts are those of the contact generator.
    [[nodiscard]] const ContactSet& contacts() const;
    [[nodiscard]] const ResponseOutput& output() const;
    /// What the contacts of effect() gave in the last step; the next one's response gets it.
    [[nodiscard]] const std::vector<ContactForce>& contact_forces() const;
    /// Contact load on every body, mean over the last tick; bodies that one operator leads share their sum.
    [[nodiscard]] const std::vector<Wrench>& body_loads() const;
    [[nodiscard]] const Outcome& outcome() const;
    /// The book_… figures of the run so far; empty where no books are kept.
    [[nodiscard]] std::map<std::string, double> audit_figures() const;
    /// Response::values_in_force of the run's response.
    [[nodiscard]] std::map<std::string, double> values_in_force() const;
    /// One flag per Topology::body_pairs entry: something in the pair gives way (tissue, an operator), so that depth
    /// left over is the method's doing and not the script's.
    [[nodiscard]] std::vector<std::uint8_t> yielding_pairs() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace trocar
