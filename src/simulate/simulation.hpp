// One run in memory: scene, detector, response and the buffers they share. step() is one tick of DESIGN §5 and fits on
// one page; replay() is the same tick with frames from outside.
#pragma once

#include <memory>

#include "contact/contact_set.hpp"
#include "contact/effect.hpp"
#include "measure/step_row.hpp"
#include "method/detector.hpp"
#include "method/response.hpp"
#include "scene/scene.hpp"
#include "tissue/hand_operator.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar {

enum class ContactSource : std::uint8_t { canonical, native };

class Simulation {
public:
    /// The scene outlives the simulation. `response` may be null (detect only; instruments follow their script).
    Simulation(const Scene& scene, std::unique_ptr<Detector> detector, std::unique_ptr<Response> response,
               ContactSource source);
    ~Simulation();
    Simulation(const Simulation&) = delete;
    Simulation& operator=(const Simulation&) = delete;
    Simulation(Simulation&&) = delete;
    Simulation& operator=(Simulation&&) = delete;

    /// Advances one tick. After a failed outcome the frame stays as it was.
    StepRow step();

    [[nodiscard]] const Frame& seen() const;   ///< the frame that detect saw in the last step
    [[nodiscard]] const Frame& frame() const;  ///< the frame after the last step
    [[nodiscard]] const ContactSet& contacts() const;
    [[nodiscard]] const Effect& effect() const;
    [[nodiscard]] const Outcome& outcome() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace trocar
