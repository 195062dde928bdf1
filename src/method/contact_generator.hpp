// Interface of a contact generator: the stage between detector and response. Its code is the same for every detector,
// and its time is reported separately.
#pragma once

#include "contact/contact_set.hpp"
#include "scene/world.hpp"

namespace trocar {

class ContactGenerator {
public:
    ContactGenerator() = default;
    ContactGenerator(const ContactGenerator&) = delete;
    ContactGenerator& operator=(const ContactGenerator&) = delete;
    ContactGenerator(ContactGenerator&&) = delete;
    ContactGenerator& operator=(ContactGenerator&&) = delete;
    virtual ~ContactGenerator() = default;

    /// Once per run, untimed. The topology outlives the generator. `first`: the scene's first frame.
    virtual void prepare(const Topology& topology, const Frame& first) = 0;
    /// Once per tick, after detect with the same frame: replaces contacts.contacts. Input is the detector's pairs and
    /// native contacts only; a generator runs no search of its own.
    virtual void gather(const Frame& frame, ContactSet& contacts) = 0;
};

}  // namespace trocar
