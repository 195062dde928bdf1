#include "study/baseline_comparison.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "contact/derive.hpp"
#include "geometry/triangle_distance.hpp"

namespace trocar {
namespace {

using What = ContactDifference::What;
using Contacts = std::vector<const Contact*>;

double gap_of_numbers(double before, double after) {
    if (std::isnan(before) && std::isnan(after)) return 0.0;
    const double size = std::abs(after - before);
    return std::isnan(size) ? HUGE_VAL : size;
}

double gap_of_points(const Vector3& before, const Vector3& after) {
    double squares = 0.0;
    for (int i = 0; i < 3; ++i) squares += std::pow(gap_of_numbers(before[i], after[i]), 2);
    return std::sqrt(squares);
}

/// rad, from the chord, which keeps its digits where the cosine loses them.
double gap_of_normals(const Vector3& before, const Vector3& after) {
    const double chord = gap_of_points(before, after);
    return std::isinf(chord) ? HUGE_VAL : 2.0 * std::asin(std::min(1.0, chord / 2.0));
}

/// Any order, as long as it is the same for the same contacts.
bool comes_first(const Contact* one, const Contact* other) {
    const auto numbers = [](const Contact& contact) {
        std::array<double, 7> all{contact.point.x(),  contact.point.y(),  contact.point.z(), contact.depth,
                                  contact.normal.x(), contact.normal.y(), contact.normal.z()};
        for (double& number : all) number = std::isnan(number) ? HUGE_VAL : number;
        return all;
    };
    return numbers(*one) < numbers(*other);
}

/// How unlike two contacts of one pair are, m; a point that only one of them has counts as far away.
double unlikeness(const Contact& one, const Contact& other) {
    return gap_of_points(one.point, other.point) + gap_of_numbers(one.depth, other.depth);
}

/// Those of `after` in the order of `before`, each beside the one that it is most like; what is left of either stands
/// at the end, beside null.
std::vector<std::pair<const Contact*, const Contact*>> matched(Contacts before, Contacts after) {
    constexpr std::size_t most_choices = 10'000;  // beyond, every one with every one would cost too much
    std::vector<std::pair<const Contact*, const Contact*>> pairs;
    std::sort(before.begin(), before.end(), comes_first);
    std::sort(after.begin(), after.end(), comes_first);
    const std::size_t possible = before.size() * after.size();
    if (possible > 1 && possible <= most_choices) {
        std::vector<std::tuple<double, std::size_t, std::size_t>> choices;
        for (std::size_t i = 0; i < before.size(); ++i) {
            for (std::size_t k = 0; k < after.size(); ++k)
                choices.emplace_back(unlikeness(*before[i], *after[k]), i, k);
        }
        std::sort(choices.begin(), choices.end());
        for (const auto& [size, i, k] : choices) {
            if (before[i] == nullptr || after[k] == nullptr) continue;
            pairs.emplace_back(std::exchange(before[i], nullptr), std::exchange(after[k], nullptr));
        }
        std::erase(before, nullptr);
        std::erase(after, nullptr);
    }
    for (std::size_t i = 0; i < std::max(before.size(), after.size()); ++i) {
        pairs.emplace_back(i < before.size() ? before[i] : nullptr, i < after.size() ? after[i] : nullptr);
    }
    return pairs;
}

double depth_or_zero(const std::optional<Contact>& contact) {
    return contact && std::isfinite(contact->depth) ? contact->depth : 0.0;
}

/// a/b <= c/d for counts, where 0/0 is 0.
bool is_no_larger_part(std::int64_t a, std::int64_t b, std::int64_t c, std::int64_t d) {
    return static_cast<long double>(a) * static_cast<long double>(std::max<std::int64_t>(d, 1)) <=
           static_cast<long double>(c) * static_cast<long double>(std::max<std::int64_t>(b, 1));
}

}  // namespace

const char* name_of(ContactDifference::What what) {
    static constexpr std::array names{"lost", "added", "changed", "missed", "untrue"};
    return names.at(static_cast<std::size_t>(what));
}

bool WorstDifferences::is_worse(const ContactDifference& one, const ContactDifference& other) const {
    // No tolerance at all: a difference of nothing is still none.
    const auto least = [](double tolerance) { return std::max(tolerance, std::numeric_limits<double>::min()); };
    const auto key = [this, least](const ContactDifference& d) {
        switch (d.what) {
            case What::lost:
                return std::pair(0, depth_or_zero(d.before));
            case What::added:
                return std::pair(1, depth_or_zero(d.after));
            case What::changed:
                return std::pair(2, std::max({d.depth / least(tolerance_.length), d.point / least(tolerance_.length),
                                              d.angle / least(tolerance_.angle)}));
            case What::missed:
                return std::pair(d.touch ? 4 : 3, depth_or_zero(d.before));
            case What::untrue:
                return std::pair(3, d.distance);
        }
        return std::pair(5, 0.0);
    };
    const auto [rank, size] = key(one);
    const auto [other_rank, other_size] = key(other);
    return std::tuple(rank, -size, one.tick, one.a, one.b) <
           std::tuple(other_rank, -other_size, other.tick, other.a, other.b);
}

void WorstDifferences::add(ContactDifference difference) {
    const auto place = std::upper_bound(
        list_.begin(), list_.end(), difference,
        [this](const ContactDifference& one, const ContactDifference& other) { return is_worse(one, other); });
    if (list_.size() == most && place == list_.end()) return;
    list_.insert(place, std::move(difference));
    if (list_.size() > most) list_.pop_back();
}

bool AnswerDifference::within(const BaselineTolerance& tolerance) const {
    return missing == 0 && extra == 0 && other_kind == 0 && outcome.empty() && worst_depth <= tolerance.length &&
           worst_point <= tolerance.length && worst_angle <= tolerance.angle;
}

AnswerDifference compare_answers(const BaselineAnswer& before, const BaselineAnswer& after,
                                 const BaselineTolerance& tolerance) {
    AnswerDifference found;
    WorstDifferences worst(tolerance);
    if (before.outcome != after.outcome) found.outcome = before.outcome + " -> " + after.outcome;
    using Key = std::tuple<std::int64_t, Index, Index>;
    std::map<Key, std::pair<Contacts, Contacts>> both;
    for (const BaselineTick& tick : before.ticks) {
        for (const Contact& contact : tick.contacts) both[{tick.tick, contact.a, contact.b}].first.push_back(&contact);
    }
    for (const BaselineTick& tick : after.ticks) {
        for (const Contact& contact : tick.contacts) both[{tick.tick, contact.a, contact.b}].second.push_back(&contact);
    }
    for (const auto& [key, lists] : both) {
        for (const auto& [old, now] : matched(lists.first, lists.second)) {
            ContactDifference difference{
                .tick = std::get<0>(key), .a = std::get<1>(key), .b = std::get<2>(key), .before = {}, .after = {}};
            if (old != nullptr) difference.before = *old;
            if (now != nullptr) difference.after = *now;
            if (old == nullptr || now == nullptr) {
                difference.what = old == nullptr ? What::added : What::lost;
                (old == nullptr ? found.extra : found.missing) += 1;
                worst.add(difference);
                continue;
            }
            ++found.compared;
            difference.what = What::changed;
            difference.depth = gap_of_numbers(old->depth, now->depth);
            difference.point = gap_of_points(old->point, now->point);
            difference.angle = gap_of_normals(old->normal, now->normal);
            found.worst_depth = std::max(found.worst_depth, difference.depth);
            found.worst_point = std::max(found.worst_point, difference.point);
            found.worst_angle = std::max(found.worst_angle, difference.angle);
            const bool other_kind = old->kind != now->kind;
            if (other_kind) ++found.other_kind;
            if (other_kind || difference.depth > tolerance.length || difference.point > tolerance.length ||
                difference.angle > tolerance.angle) {
                worst.add(difference);
            }
        }
    }
    found.worst = worst.list();
    return found;
}

void keep_every(std::int64_t every, BaselineAnswer& answer) {
    std::erase_if(answer.ticks, [every](const BaselineTick& tick) { return tick.tick % every != 0; });
}

void TruthComparison::add(const Topology& topology, const Frame& frame, const TickTruth& truth,
                          const std::vector<Contact>& contacts) {
    std::vector<TrianglePair> reported;
    std::map<TrianglePair, const Contact*> meeting;  // pairs that meet by some contact
    for (const Contact& contact : contacts) {
        reported.push_back({contact.a, contact.b});
        if (!(contact.depth < 0.0)) meeting.emplace(reported.back(), &contact);
    }
    std::sort(reported.begin(), reported.end());
    reported.erase(std::unique(reported.begin(), reported.end()), reported.end());
    ++figures_.ticks;
    figures_.pairs += static_cast<std::int64_t>(truth.pairs.size());
    for (std::size_t i = 0; i < truth.pairs.size(); ++i) {
        const TrianglePair pair = truth.pairs[i];
        if (std::binary_search(reported.begin(), reported.end(), pair)) {
            ++figures_.reported;
            meeting.erase(pair);
            continue;
        }
        const bool touch = std::binary_search(truth.touch.begin(), truth.touch.end(), static_cast<Index>(i));
        ++figures_.false_negatives;
        if (touch) ++figures_.false_negatives_touch;
        worst_.add({.what = What::missed,
                    .tick = frame.tick,
                    .a = pair.a,
                    .b = pair.b,
                    .before = derive_contact(topology, frame, pair),
                    .after = {},
                    .touch = touch});
    }
    for (const auto& [pair, contact] : meeting) {
        ++figures_.reported;
        ++figures_.false_positives;
        const TriangleDistance distance = triangle_distance(corners_of(topology.triangles, frame.position, pair.a),
                                                            corners_of(topology.triangles, frame.position, pair.b));
        worst_.add({.what = What::untrue,
                    .tick = frame.tick,
                    .a = pair.a,
                    .b = pair.b,
                    .before = {},
                    .after = *contact,
                    .distance = std::sqrt(distance.squared_distance)});
    }
}

bool is_no_worse(const std::optional<TruthFigures>& before, std::int64_t ticks_before, const TruthFigures& after,
                 std::int64_t ticks_after) {
    if (!before) return after.false_negatives == 0 && after.false_positives == 0;
    const std::int64_t ignored = before->false_negatives_touch > 0 ? after.false_negatives_touch : 0;
    const std::int64_t ignored_before = before->false_negatives_touch;
    return is_no_larger_part(after.false_negatives - ignored, after.pairs, before->false_negatives - ignored_before,
                             before->pairs) &&
           is_no_larger_part(after.false_positives, after.reported, before->false_positives, before->reported) &&
           is_no_larger_part(before->ticks, ticks_before, after.ticks, ticks_after);
}

}  // namespace trocar
