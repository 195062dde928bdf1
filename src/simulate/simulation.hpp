// One run in memory: scene, detector, response and their buffers. step() is one tick of DESIGN §5; replay() is the same
// tick with frames from outside.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "contact/contact_set.hpp"
#include "contact/response_output.hpp"
#include "contact/tip_force.hpp"
#include "measure/metric.hpp"
#include "measure/step_row.hpp"
#include "method/entry.hpp"
#include "method/registry.hpp"
#include "scene/scene.hpp"

namespace trocar {

/// Settings of a run beside its methods.
struct SimulationSettings {
    MethodSpec stepper = {};  ///< empty name: the default one
    TipSettings device = {};  ///< displayed force on the instrument, by the same rule for every response
    /// Runs the energy and momentum audit, outside the clock. A tick with unstable contact then ends `unstable`
    /// (blow_up.hpp).
    bool watched = true;
};

class Simulation {
public:
    /// The scene outlives the simulation. A null `response` means detection only: bodies follow their scripts and
    /// tissue is static. `generator` makes the contacts (Registry::contact_generator); the detector gets a query
    /// distance where `generator` needs one. A response output that the stepper does not support ends `unsupported`. An
    /// exception while a method is prepared sets outcome(), and every step then fails with it.
    Simulation(const Scene& scene, std::unique_ptr<Detector> detector, std::unique_ptr<Response> response,
               const ContactGeneratorEntry& generator, const SimulationSettings& settings = {});
    ~Simulation();
    Simulation(const Simulation&) = delete;
    Simulation& operator=(const Simulation&) = delete;
    Simulation(Simulation&&) = delete;
    Simulation& operator=(Simulation&&) = delete;

    /// Does one tick. The first is tick 0 on the scene's first frame. After a failure the frame is unchanged. Truth
    /// fields of the row stay unset.
    StepRow step();

    /// Runs update, detect and contacts on a given frame and does not advance the world. seen() is then that frame.
    StepRow replay(const Frame& frame);

    [[nodiscard]] const Frame& seen() const;   ///< the frame that detect read in the last step
    [[nodiscard]] const Frame& frame() const;  ///< the frame after the last step
    /// frame() with deferred vertices completed (Stepper::complete), for the energy and momentum audit. Equals frame()
    /// where nothing is deferred or the simulation is not `watched`.
    [[nodiscard]] const Frame& whole_frame() const;
    /// Result of the last detect; contacts.contacts are those of the contact generator.
    [[nodiscard]] const ContactSet& contacts() const;
    [[nodiscard]] const ResponseOutput& output() const;
    /// Forces of the contacts of output() in the last step; input of the next response.
    [[nodiscard]] const std::vector<ContactForce>& contact_forces() const;
    /// Contact load on every body, mean over the last tick; bodies of one operator share their sum.
    [[nodiscard]] const std::vector<Wrench>& body_loads() const;
    [[nodiscard]] const Outcome& outcome() const;
    /// The audit figures of the run so far; empty without the audit.
    [[nodiscard]] Summary audit_figures() const;
    /// J, gain of kinetic and elastic energy of tissue since the start; NaN without the audit.
    [[nodiscard]] double tissue_energy_gain() const;
    /// Response::values_in_force of the run's response.
    [[nodiscard]] std::optional<ForceLawValues> values_in_force() const;
    /// One flag per Topology::body_pairs entry: the pair contains tissue or an operator. Its residual penetration then
    /// depends on the method and not on the script alone.
    [[nodiscard]] std::vector<std::uint8_t> yielding_pairs() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace trocar
