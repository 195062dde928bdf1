// What the FCL adapters do when the library throws, once for all of them: the tick ends as `threw`, and what was built
// is built anew at the next one.
#pragma once

#include <fmt/format.h>

#include <exception>
#include <string>

#include "contact/contact_set.hpp"

namespace trocar::baselines {

/// Calls `query` unless `failure` already tells why the update failed. After a failure of either, `contacts` holds no
/// pair but the outcome, `failure` is empty again, and `forget` has been called.
template <typename Query, typename Forget>
void query_or_tell(std::string& failure, ContactSet& contacts, const Query& query, const Forget& forget) {
    try {
        if (failure.empty()) query();
    } catch (const std::exception& error) {
        failure = fmt::format("FCL threw during the query: {}", error.what());
    }
    if (failure.empty()) return;
    contacts.clear();
    contacts.outcome = {OutcomeKind::threw, failure};
    failure.clear();
    forget();
}

}  // namespace trocar::baselines
