#pragma once

#pragma GCC visibility push(default)

// Entry point of the run-time module libamontons-studio.so: plain C, opened by the command studio
// alone. The module serves pages; it contains no physics and links nothing of amontons.

/// The entry of the module.
extern "C" {

/// What the page is served from, and where the engine is.
struct AmontonsStudio {
    const char* program; ///< started as the engine: PROGRAM serve SCENE --frames FD
    const char* pages;   ///< folder of the built page
    const char* root;    ///< folder that scenes and results lie below, absolute
    const char* open;    ///< what the page opens first, relative to root; "": nothing
    const char* results; ///< folder that runs are written to, absolute; "": they are not written
    const char* schema;  ///< of scenes, as JSON
    const char* version; ///< of the program
    int port;            ///< 0: any that is free
    double idle_seconds; ///< ends without a page for so long; 0: never
    /// Called once when pages are answered, with the address that a browser opens.
    void (*ready)(const char* address, int port);
    /// True once it is to end.
    int (*stop)();
};

/// Serves until it is to end.
/// @return  "" or what failed; lives as long as the module
const char* amontons_studio_serve(const AmontonsStudio* how);
}

#pragma GCC visibility pop
