// Interface of a contact response: from contacts to a ResponseOutput. It never writes the frame.
#pragma once

#include <limits>
#include <optional>
#include <span>

#include "contact/contact_set.hpp"
#include "contact/response_output.hpp"
#include "scene/world.hpp"

namespace trocar {

/// The force law in force, of the stiffest pair with tissue; NaN: not known.
struct ForceLawValues {
    double k = std::numeric_limits<double>::quiet_NaN();                ///< N/m
    double mu = std::numeric_limits<double>::quiet_NaN();               ///< N s/m
    double relaxation_time = std::numeric_limits<double>::quiet_NaN();  ///< s, mu / k
    /// mu / (2 √(k m)), m the mean mass of a tissue vertex; 1: critical.
    double damping_ratio = std::numeric_limits<double>::quiet_NaN();
};

class Response {
public:
    Response() = default;
    Response(const Response&) = delete;
    Response& operator=(const Response&) = delete;
    Response(Response&&) = delete;
    Response& operator=(Response&&) = delete;
    virtual ~Response() = default;

    /// Values of the force law after `prepare`; none without a force law.
    [[nodiscard]] virtual std::optional<ForceLawValues> values_in_force() const { return std::nullopt; }
    /// Once per run. Topology and materials outlive the response's use of them.
    virtual void prepare(const Topology& topology, const Materials& materials) = 0;
    /// Once per tick. contacts.contacts holds the generator's contacts that ContactSelection passes on. A positive gap
    /// is an open contact, whose force law acts from the sub-step in which the gap closes. contact_forces[i]: force of
    /// contact i of the last tick's output; empty at tick 0 and without stepper. The caller sizes `output`, the callee
    /// clears it.
    virtual void respond(const Frame& frame, double dt, const ContactSet& contacts,
                         std::span<const ContactForce> contact_forces, ResponseOutput& output) = 0;
};

}  // namespace trocar
