// Starting and stopping the ODE library, once per process and once per thread, for all methods that use it: a second
// initialisation while the first is alive trips ODE's own run-time checks.
#pragma once

#include <ode/ode.h>

#include <cstdarg>
#include <cstdio>
#include <stdexcept>
#include <string>

namespace trocar {

/// Call before any other use of ODE in a thread. Initialises the library at the first call of the process, with its
/// message handlers silenced, and this thread's collision data at the first call of the thread.
inline void use_ode() {
    struct Library {
        [[noreturn]] static void throw_message(int /*number*/, const char* format, va_list arguments) {
            char text[512] = {};
            std::vsnprintf(text, sizeof text, format, arguments);
            throw std::runtime_error(text);
        }
        Library() {
            dInitODE2(0);
            // ODE prints to stderr in the middle of a query otherwise (full contact buckets, degenerate triangles).
            dSetMessageHandler([](int, const char*, va_list) {});
            // A failed run-time check inside ODE would abort the process. As an exception it fails one query: ODE
            // clears the state of a query at the start of the next.
            dSetDebugHandler(throw_message);
            dSetErrorHandler(throw_message);
        }
        ~Library() { dCloseODE(); }
        Library(const Library&) = delete;
        Library& operator=(const Library&) = delete;
        Library(Library&&) = delete;
        Library& operator=(Library&&) = delete;
    };
    static const Library library;
    thread_local const bool ready = dAllocateODEDataForThread(dAllocateMaskAll) != 0;
    (void)ready;
}

/// "0.16.2" from the library's own description of its build is not to be had; the package says it. What can be asked:
/// precision, collider and checks, as one text.
inline std::string ode_configuration() { return dGetConfiguration(); }

/// True when the library and its headers agree on the size of a number.
inline bool ode_precision_matches() {
    return (dCheckConfiguration("ODE_double_precision") != 0) == (sizeof(dReal) == sizeof(double));
}

}  // namespace trocar
