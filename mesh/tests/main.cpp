#include "mesh/tests/test_program.hpp"

int main(int argc, char** argv) { return amontons::run_tests(argc, argv); }
