// Contact generator `intersection`: one contact per intersecting triangle pair, from its geometry alone, as in the
// thesis.
#include <memory>

#include "contact/derive.hpp"
#include "contact_generation/pair_contacts.hpp"
#include "method/entry.hpp"

namespace trocar {
namespace {

class Intersection final : public ContactGenerator {
public:
    void prepare(const Topology& topology, const Frame& /*first*/) override { topology_ = &topology; }

    void gather(const Frame& frame, ContactSet& contacts) override {
        derive(*topology_, frame, contacts);
        const TickStart start(*topology_, frame);
        for (Contact& contact : contacts.contacts) {
            constexpr std::uint64_t of_triangles = std::uint64_t{1} << 62;
            contact.id =
                of_triangles | (static_cast<std::uint64_t>(contact.a) << 31) | static_cast<std::uint64_t>(contact.b);
            place_at_start(start, contact);
        }
    }

private:
    const Topology* topology_ = nullptr;
};

}  // namespace

ContactGeneratorEntry intersection_contact_generator() {
    ContactGeneratorEntry entry;
    entry.name = "intersection";
    entry.version = "1";
    entry.meaning = "one contact per pair of triangles that meet, from their geometry alone";
    entry.make = [](const ParameterValues&) { return std::make_unique<Intersection>(); };
    return entry;
}

}  // namespace trocar
