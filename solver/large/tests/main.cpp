// Runs the tests on rank 0; under mpirun the other ranks work for it.

#define DOCTEST_CONFIG_IMPLEMENT
#include "solver/large/large_matrix.hpp"

#include <doctest/doctest.h>

int main(int argc, char** argv)
{
    amontons::ParallelRun parallel;
    if (parallel.served()) return 0;
    return doctest::Context(argc, argv).run();
}
