// Initializes and closes ODE for all methods, once per process and thread. A second initialization of a running ODE
// fails its run-time checks.
#pragma once

#include <ode/ode.h>

#include <cstdarg>
#include <cstdio>
#include <stdexcept>
#include <string>

namespace trocar {

/// Call before any other use of ODE in a thread. The first call of the process initializes ODE and silences its message
/// handlers. The first call of a thread allocates its collision data.
inline void use_ode() {
    struct Library {
        [[noreturn]] static void throw_message(int /*number*/, const char* format, va_list arguments) {
            char text[512] = {};
            std::vsnprintf(text, sizeof text, format, arguments);
            throw std::runtime_error(text);
        }
        Library() {
            dInitODE2(0);
            // ODE otherwise prints to stderr during queries (full contact buckets, degenerate triangles).
            dSetMessageHandler([](int, const char*, va_list) {});
            // A failed run-time check of ODE aborts the process by default. As an exception it fails one query; ODE
            // resets its query state at the next.
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

/// ODE's build configuration as text: precision, collider and checks. ODE does not report its version number.
inline std::string ode_configuration() { return dGetConfiguration(); }

/// True when library and headers use the same floating-point size.
inline bool ode_precision_matches() {
    return (dCheckConfiguration("ODE_double_precision") != 0) == (sizeof(dReal) == sizeof(double));
}

}  // namespace trocar
