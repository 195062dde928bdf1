#include "study/baseline_comparison.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "study/kept_contacts.hpp"

namespace trocar {
namespace {

const BaselineTolerance nanometre;

TEST(BaselineComparison, TheSameAnswerIsTheSame) {
    const AnswerDifference found = compare_answers(three_contacts(), three_contacts(), nanometre);
    EXPECT_TRUE(found.within(nanometre));
    EXPECT_EQ(found.compared, 3);
}

TEST(BaselineComparison, OneWrongContactAmongThousandsIsTheWorstNotTheMean) {
    BaselineAnswer before;
    for (Index i = 0; i < 5000; ++i) before.ticks.push_back({.tick = i, .contacts = {contact_at(i, i + 1, 1e-3)}});
    BaselineAnswer after = before;
    after.ticks[777].contacts[0].depth += 5e-6;
    const AnswerDifference found = compare_answers(before, after, nanometre);
    EXPECT_FALSE(found.within(nanometre));
    EXPECT_NEAR(found.worst_depth, 5e-6, 1e-18);
    EXPECT_EQ(found.worst_point, 0.0);
    ASSERT_EQ(found.worst.size(), 1U);
    EXPECT_EQ(found.worst[0].what, ContactDifference::What::changed);
    EXPECT_EQ(found.worst[0].tick, 777);
    EXPECT_EQ(found.worst[0].a, 777);
    EXPECT_EQ(found.worst[0].b, 778);
    EXPECT_NEAR(found.worst[0].depth, 5e-6, 1e-18);
}

TEST(BaselineComparison, ATurnedNormalIsMeasuredAsAnAngle) {
    BaselineAnswer after = three_contacts();
    after.ticks[1].contacts[0].normal = {std::sin(0.01), 0.0, std::cos(0.01)};
    EXPECT_NEAR(compare_answers(three_contacts(), after, nanometre).worst_angle, 0.01, 1e-12);
    after.ticks[1].contacts[0].normal = {0.0, 0.0, -1.0};
    EXPECT_NEAR(compare_answers(three_contacts(), after, nanometre).worst_angle, std::acos(-1.0), 1e-12);
    // Longer than a unit by rounding: half their difference is no sine.
    after.ticks[1].contacts[0].normal = {0.0, 0.0, std::nextafter(-1.0, -2.0)};
    BaselineAnswer before = three_contacts();
    before.ticks[1].contacts[0].normal = {0.0, 0.0, std::nextafter(1.0, 2.0)};
    EXPECT_NEAR(compare_answers(before, after, nanometre).worst_angle, std::acos(-1.0), 1e-12);
}

TEST(BaselineComparison, ANumberThatIsLostIsInfinitelyWrong) {
    BaselineAnswer after = three_contacts();
    after.ticks[0].contacts[1].depth = Contact::unset;
    EXPECT_TRUE(std::isinf(compare_answers(three_contacts(), after, nanometre).worst_depth));
    EXPECT_TRUE(compare_answers(after, after, nanometre).within(nanometre)) << "unset on both sides is the same";
}

/// Far above anything that the other figures say, so that the one count alone decides.
constexpr BaselineTolerance kilometre{.length = 1000.0, .angle = 10.0};

TEST(BaselineComparison, ALostContactAloneIsNotTheSame) {
    BaselineAnswer after = three_contacts();
    after.ticks[1].contacts.clear();
    const AnswerDifference found = compare_answers(three_contacts(), after, kilometre);
    EXPECT_EQ(found.missing, 1);
    EXPECT_EQ(found.extra, 0);
    EXPECT_FALSE(found.within(kilometre));
    ASSERT_EQ(found.worst.size(), 1U);
    EXPECT_EQ(found.worst[0].what, ContactDifference::What::lost);
    EXPECT_EQ(found.worst[0].tick, 40);
    EXPECT_EQ(found.worst[0].before->depth, 3e-3);
    EXPECT_FALSE(found.worst[0].after.has_value());
}

TEST(BaselineComparison, ANewContactAloneIsNotTheSame) {
    const AnswerDifference found = compare_answers({.ticks = {}}, three_contacts(), kilometre);
    EXPECT_EQ(found.missing, 0);
    EXPECT_EQ(found.extra, 3);
    EXPECT_FALSE(found.within(kilometre));
    EXPECT_EQ(found.worst.at(0).what, ContactDifference::What::added);
    EXPECT_EQ(found.worst.at(0).tick, 40) << "the deepest first";
}

TEST(BaselineComparison, AnotherKindAloneAndAnotherOutcomeAloneAreNotTheSame) {
    BaselineAnswer after = three_contacts();
    after.ticks[0].contacts[0].kind = ContactCase::edges_cross;
    const AnswerDifference found = compare_answers(three_contacts(), after, kilometre);
    EXPECT_EQ(found.other_kind, 1);
    EXPECT_FALSE(found.within(kilometre));
    after = three_contacts();
    after.outcome = "truncated";
    EXPECT_FALSE(compare_answers(three_contacts(), after, kilometre).within(kilometre));
}

TEST(BaselineComparison, EachFigureHasItsTolerance) {
    const auto moved = [](double depth, double point, double angle) {
        BaselineAnswer after = three_contacts();
        Contact& contact = after.ticks[1].contacts[0];
        contact.depth += depth;
        contact.point.x() += point;
        contact.normal = {std::sin(angle), 0.0, std::cos(angle)};
        const BaselineTolerance tolerance{.length = 1e-4, .angle = 1e-3};
        return compare_answers(three_contacts(), after, tolerance).within(tolerance);
    };
    EXPECT_TRUE(moved(0.9e-4, 0.9e-4, 0.9e-3));
    EXPECT_FALSE(moved(1.1e-4, 0.0, 0.0));
    EXPECT_FALSE(moved(0.0, 1.1e-4, 0.0));
    EXPECT_FALSE(moved(0.0, 0.0, 1.1e-3));
}

TEST(BaselineComparison, TheTenWorstAreReportedTheLostAndTheDeepestFirst) {
    BaselineAnswer before;
    BaselineAnswer after;
    for (Index i = 0; i < 30; ++i) {
        before.ticks.push_back({.tick = i, .contacts = {contact_at(i, i + 1, 1e-3 * (i % 7))}});
        after.ticks.push_back(before.ticks.back());
        if (i < 8) {
            after.ticks.back().contacts.clear();
        } else {
            after.ticks.back().contacts[0].depth += 1e-6 * i;
        }
    }
    const AnswerDifference found = compare_answers(before, after, nanometre);
    EXPECT_EQ(found.missing, 8);
    ASSERT_EQ(found.worst.size(), 10U);
    std::vector<std::int64_t> ticks;
    for (const ContactDifference& one : found.worst) ticks.push_back(one.tick);
    EXPECT_EQ(ticks, (std::vector<std::int64_t>{6, 5, 4, 3, 2, 1, 0, 7, 29, 28})) << "of equal depth the first tick";
}

/// Contacts of one pair, 0.1 m apart along x from the place `first` on.
BaselineAnswer row_of(int count, int first = 0) {
    BaselineAnswer answer;
    answer.ticks.push_back({.tick = 3, .contacts = {}});
    for (int i = first; i < first + count; ++i) {
        answer.ticks[0].contacts.push_back(contact_at(0, 5, 1e-3));
        answer.ticks[0].contacts.back().point = {0.1 * i, 0.0, 0.0};
    }
    return answer;
}

TEST(BaselineComparison, SeveralContactsOfAPairAreHeldAgainstTheNearest) {
    const BaselineAnswer before = row_of(4);
    BaselineAnswer after = before;
    std::reverse(after.ticks[0].contacts.begin(), after.ticks[0].contacts.end());
    EXPECT_TRUE(compare_answers(before, after, nanometre).within(nanometre)) << "their order says nothing";
    // The first moves by a little, the third is gone.
    after = before;
    after.ticks[0].contacts[0].point.x() = 0.01;
    after.ticks[0].contacts.erase(after.ticks[0].contacts.begin() + 2);
    const AnswerDifference found = compare_answers(before, after, nanometre);
    EXPECT_EQ(found.missing, 1);
    EXPECT_EQ(found.compared, 3);
    EXPECT_NEAR(found.worst_point, 0.01, 1e-15);
    EXPECT_EQ(found.worst.at(0).before->point.x(), 0.2);
}

TEST(BaselineComparison, ContactsAtOnePointAreHeldAgainstThoseOfTheirDepth) {
    const auto at_depths = [](double one, double other) {
        BaselineAnswer answer{.ticks = {{.tick = 0, .contacts = {contact_at(0, 5, one), contact_at(0, 5, other)}}}};
        for (Contact& contact : answer.ticks[0].contacts) contact.point = {0.25, 0.25, 0.0};
        return answer;
    };
    // 2 mm stays and 1 mm became 3 mm; by their order each would have grown by 1 mm.
    const AnswerDifference found = compare_answers(at_depths(1e-3, 2e-3), at_depths(2e-3, 3e-3), nanometre);
    EXPECT_NEAR(found.worst_depth, 2e-3, 1e-15);
}

TEST(BaselineComparison, FewContactsAmongManyAreHeldAgainstTheNearestToo) {
    const BaselineAnswer many = row_of(150);
    for (const std::vector<std::size_t>& left : {std::vector<std::size_t>{70}, {30, 70}, {149, 0, 70}}) {
        BaselineAnswer few;
        few.ticks.push_back({.tick = 3, .contacts = {}});
        for (const std::size_t i : left) few.ticks[0].contacts.push_back(many.ticks[0].contacts[i]);
        const auto others = static_cast<std::int64_t>(150 - left.size());
        const AnswerDifference grown = compare_answers(few, many, nanometre);
        EXPECT_EQ(grown.extra, others);
        EXPECT_EQ(grown.missing, 0);
        EXPECT_EQ(grown.worst_point, 0.0) << left.size();
        const AnswerDifference shrunk = compare_answers(many, few, nanometre);
        EXPECT_EQ(shrunk.missing, others);
        EXPECT_EQ(shrunk.extra, 0);
        EXPECT_EQ(shrunk.worst_point, 0.0) << left.size();
    }
}

TEST(BaselineComparison, BeyondTenThousandChoicesTheContactsOfAPairGoByTheirOrder) {
    // A row of contacts 0.1 m apart that has moved on by one. Held against the nearest all are where another was but
    // the two ends, which are left for each other; in their order each is 0.1 m off.
    for (const auto& [count, worst] : {std::pair{100, 10.0}, {101, 0.1}}) {
        const AnswerDifference found = compare_answers(row_of(count), row_of(count, 1), nanometre);
        EXPECT_EQ(found.compared, count);
        EXPECT_EQ(found.missing, 0);
        EXPECT_EQ(found.extra, 0);
        EXPECT_NEAR(found.worst_point, worst, 1e-9);
    }
}

TEST(BaselineComparison, OnlyTheTicksThatAreWantedStay) {
    BaselineAnswer answer;
    for (const std::int64_t tick : {0, 3, 4, 6, 8}) answer.ticks.push_back({.tick = tick, .contacts = {}});
    keep_every(4, answer);
    ASSERT_EQ(answer.ticks.size(), 3U);
    EXPECT_EQ(answer.ticks[1].tick, 4);
}

/// Body a: triangles 0, 1, 2 in z = 0, side by side along x; body b: triangles 3, 4, 5 above them; 3 sticks through 0
/// by 0.25, 4 touches 1 with a corner, 5 is 0.5 above 2.
struct ThreeOverThree {
    ThreeOverThree() {
        Triangles faces(3, 3);
        faces << 0, 3, 6, 1, 4, 7, 2, 5, 8;
        topology = make_topology(
            {{.name = "a", .kind = BodyKind::tissue, .closed = false, .vertex_count = 9, .triangles = faces},
             {.name = "b", .kind = BodyKind::instrument, .vertex_count = 9, .triangles = faces}});
        frame.position.resize(3, 18);
        const std::array<double, 3> low{-0.25, 0.0, 0.5};
        for (Index i = 0; i < 3; ++i) {
            const double x = 10.0 * i;
            frame.position.middleCols<3>(3 * i) << x, x + 4.0, x, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0;
            const double z = low[static_cast<std::size_t>(i)];
            frame.position.middleCols<3>(9 + 3 * i) << x + 1.0, x + 1.0, x + 1.5, 1.0, 1.0, 1.0, z, 3.0, 3.0;
        }
        frame.tick = 7;
    }
    [[nodiscard]] TruthComparison compare(const std::vector<Contact>& contacts) const {
        TruthComparison comparison;
        comparison.add(topology, frame, truth_of(topology, frame), contacts);
        return comparison;
    }
    Topology topology;
    Frame frame;
};

TEST(BaselineTruth, PairsThatAreReportedRightAreRight) {
    const TruthComparison found = ThreeOverThree().compare({contact_at(0, 3, 0.25), contact_at(1, 4, 0.0)});
    EXPECT_EQ(found.figures(), (TruthFigures{.ticks = 1, .pairs = 2, .reported = 2}));
    EXPECT_TRUE(found.worst().empty());
}

TEST(BaselineTruth, MissedAndUntruePairsAreReportedWithTheirSize) {
    const TruthComparison found = ThreeOverThree().compare({contact_at(2, 5, 0.1), contact_at(2, 5, 0.2)});
    EXPECT_EQ(found.figures(), (TruthFigures{.ticks = 1,
                                             .pairs = 2,
                                             .reported = 1,
                                             .false_negatives = 2,
                                             .false_negatives_touch = 1,
                                             .false_positives = 1}));
    ASSERT_EQ(found.worst().size(), 3U);
    EXPECT_EQ(found.worst()[0].what, ContactDifference::What::untrue);
    EXPECT_EQ(found.worst()[0].distance, 0.5);
    EXPECT_EQ(found.worst()[0].b, 5);
    EXPECT_EQ(found.worst()[1].what, ContactDifference::What::missed);
    EXPECT_EQ(found.worst()[1].a, 0);
    EXPECT_EQ(found.worst()[1].tick, 7);
    EXPECT_EQ(found.worst()[1].before->depth, 0.25) << "what the coordinates report";
    EXPECT_TRUE(found.worst()[2].touch);
}

TEST(BaselineTruth, AContactThatSaysApartIsNoUntruePair) {
    const ThreeOverThree scene;
    const TruthComparison found =
        scene.compare({contact_at(0, 3, -0.1), contact_at(1, 4, 0.0), contact_at(2, 5, -0.5)});
    EXPECT_EQ(found.figures(), (TruthFigures{.ticks = 1, .pairs = 2, .reported = 2}))
        << "but it finds a pair that meets";
    Contact without_depth = contact_at(2, 5, Contact::unset);
    EXPECT_EQ(scene.compare({without_depth}).figures().false_positives, 1);
}

TEST(BaselineTruth, NoWorseMeansNoLargerPartMissedOrUntrueAndNoLessSearchedAt) {
    const TruthFigures before{.ticks = 10,
                              .pairs = 100,
                              .reported = 98,
                              .false_negatives = 4,
                              .false_negatives_touch = 0,
                              .false_positives = 2};
    const auto no_worse = [&before](const TruthFigures& after, std::int64_t ticks) {
        return is_no_worse(before, 10, after, ticks);
    };
    EXPECT_TRUE(no_worse(before, 10));
    TruthFigures twice{.ticks = 20,
                       .pairs = 200,
                       .reported = 196,
                       .false_negatives = 8,
                       .false_negatives_touch = 0,
                       .false_positives = 4};
    EXPECT_TRUE(no_worse(twice, 20));
    EXPECT_FALSE(no_worse(twice, 21)) << "one tick of which nothing is reported";
    twice.false_negatives = 9;
    EXPECT_FALSE(no_worse(twice, 20));
    twice.false_negatives = 8;
    twice.false_positives = 5;
    EXPECT_FALSE(no_worse(twice, 20));
    EXPECT_FALSE(no_worse({}, 10)) << "says nothing of any tick";
    EXPECT_TRUE(no_worse({.ticks = 10}, 10)) << "nothing meets, nothing is reported";
    EXPECT_FALSE(is_no_worse(TruthFigures{.ticks = 1}, 1, {.ticks = 1, .pairs = 1, .false_negatives = 1}, 1));
}

TEST(BaselineTruth, TouchingPairsCountWhereNoneWereMissedBefore) {
    const TruthFigures touching{
        .ticks = 1, .pairs = 10, .reported = 7, .false_negatives = 3, .false_negatives_touch = 3};
    EXPECT_FALSE(is_no_worse(TruthFigures{.ticks = 1, .pairs = 10, .reported = 10}, 1, touching, 1));
    const TruthFigures one_before{
        .ticks = 1, .pairs = 10, .reported = 9, .false_negatives = 1, .false_negatives_touch = 1};
    EXPECT_TRUE(is_no_worse(one_before, 1, touching, 1));
    TruthFigures one_more = touching;
    one_more.false_negatives = 4;
    EXPECT_FALSE(is_no_worse(one_before, 1, one_more, 1)) << "one of these goes through";
}

TEST(BaselineTruth, WithoutFiguresOfBeforeNothingMayBeWrong) {
    EXPECT_TRUE(is_no_worse(std::nullopt, 1, {.ticks = 1, .pairs = 5, .reported = 5}, 1));
    EXPECT_FALSE(is_no_worse(std::nullopt, 1, {.ticks = 1, .pairs = 5, .reported = 4, .false_negatives = 1}, 1));
    EXPECT_FALSE(is_no_worse(std::nullopt, 1, {.ticks = 1, .pairs = 5, .reported = 6, .false_positives = 1}, 1));
}

}  // namespace
}  // namespace trocar
