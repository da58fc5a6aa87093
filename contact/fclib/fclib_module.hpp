#pragma once

// The entry points of the run-time module libamontons-fclib.so, as plain C: the program opens it
// with dlopen only when a contact problem is read or written, so that no other command maps HDF5
// and the 35 libraries behind it. Never link the module; resolve its names at run time.
//
// The module depends on HDF5 and contains nothing of contact. A file is bytes in memory on one
// side, and on the other the datasets that are in it (contact/named_arrays.hpp).
//
// HDF5's C library is not made for foreign files: a damaged one can crash it, or keep it in a
// loop (docs/decisions/0006). Each call therefore does its work in a child process with limited
// memory and time; what happens there ends in a message.
//
// Every function returns 0 when it did what it specifies. Otherwise it returns 1, the outputs are
// null, and `message` holds what is wrong (cut to message_size, ends with '\0'). No exception
// leaves the module.

#pragma GCC visibility push(default)
extern "C" {

/// All datasets of the groups in a file, packed.
///
/// Only hard links are followed: nothing outside the file is opened.
/// @param file    an HDF5 file's bytes
/// @param groups  names of groups in the file's root, separated by spaces; others are not read
/// @param memory  all values together may take this much [bytes]
/// @param time    processor time that the reading may take [s]
/// @param arrays  packed arrays; to be given back to amontons_fclib_free
int amontons_fclib_read(const char* file, long file_size, const char* groups, double memory,
                        double time, char** arrays, long* arrays_size, char* message,
                        int message_size);

/// The bytes of an HDF5 file that holds these arrays, groups made as their names specify.
/// @param base  a file's bytes that the new one starts as (base_size 0: an empty one). A group in
///              its root that one of the arrays is in is replaced, all else stays
/// @param file  the new file's bytes; to be given back to amontons_fclib_free
int amontons_fclib_write(const char* base, long base_size, const char* arrays, long arrays_size,
                         char** file, long* file_size, char* message, int message_size);

/// Gives back what one of the functions above returned; null is allowed.
void amontons_fclib_free(char* bytes);

} // extern "C"
#pragma GCC visibility pop
