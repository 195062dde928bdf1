#include "contact/contact_set.hpp"

#include <algorithm>
#include <utility>

namespace trocar {
namespace {

void put_in_order(std::vector<TrianglePair>& pairs) {
    for (TrianglePair& pair : pairs) {
        if (pair.b < pair.a) std::swap(pair.a, pair.b);
    }
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
}

}  // namespace

WorkCounters& WorkCounters::operator+=(const WorkCounters& other) {
    vertices_read += other.vertices_read;
    cells_visited += other.cells_visited;
    box_tests += other.box_tests;
    triangle_tests += other.triangle_tests;
    return *this;
}

void ContactSet::clear() {
    answer_nothing();
    query_distance = 0.0;
    contacts.clear();
    work = {};
}

void ContactSet::answer_nothing() {
    pairs.clear();
    near.clear();
    native.clear();
    swept.clear();
    truncated = false;
    outcome.kind = OutcomeKind::ok;
    outcome.message.clear();
}

void ContactSet::sort() {
    put_in_order(pairs);
    put_in_order(near);
}

}  // namespace trocar
