// The interface of a contact response: from contacts to an ResponseOutput. It reads the frame and never writes it.
#pragma once

#include <map>
#include <span>
#include <string>

#include "contact/contact_set.hpp"
#include "contact/response_output.hpp"
#include "scene/world.hpp"

namespace trocar {

class Response {
public:
    Response() = default;
    Response(const Response&) = delete;
    Response& operator=(const Response&) = delete;
    Response(Response&&) = delete;
    Response& operator=(Response&&) = delete;
    virtual ~Response() = default;

    /// Values that act after `prepare`, as figures of the run (`trocar schema figures`) by name, in SI units.
    [[nodiscard]] virtual std::map<std::string, double> values_in_force() const { return {}; }
    /// Once per run. Topology and materials outlive the response's use of them.
    virtual void prepare(const Topology& topology, const Materials& materials) = 0;
    /// Once per tick. `contacts` holds in contacts.contacts what ContactSelection passes on of the run's generator. A
    /// positive gap is an open contact: a force law for it acts from the sub-step on in which the gap closes.
    /// contact_forces[i]: what contact i of the last tick's effect gave; empty at tick 0 and where no stepper ran.
    /// `output` holds the last tick's, is cleared by the callee and was sized by the caller.
    virtual void respond(const Frame& frame, double dt, const ContactSet& contacts,
                         std::span<const ContactForce> contact_forces, ResponseOutput& output) = 0;
};

}  // namespace trocar
