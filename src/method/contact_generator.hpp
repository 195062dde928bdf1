// The interface of a contact generator: the stage between a detector's pairs and a response, the same code for every
// detector, with a column of its own in every table of times.
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

    /// Once per run, untimed: the topology outlives the source. `first` is the scene's first frame.
    virtual void prepare(const Topology& topology, const Frame& first) = 0;
    /// Once per tick, after detect with the same frame: replaces contacts.contacts by what the pairs (and native
    /// contacts) report. Nothing but the pairs says what is near: no source searches for itself.
    virtual void gather(const Frame& frame, ContactSet& contacts) = 0;
};

}  // namespace trocar
