#!/usr/bin/env python3
"""What a machine of P ranks would need for N unknowns and m contacts, from constants measured on a small one.

    large_model.py [--unknowns 1e9] [--contacts 1e6] [--ranks 256,1024,4096]

The model: docs/theory/large_machines.md. Constants: docs/results (large_solids.csv, exchange.csv); a cluster's
network is an assumption and stands below as one.
"""
import argparse
import math

# Measured here: T4, one rank.
COUPLINGS = 15.0  # nodes that share an element with one, itself included
ITERATION = 1.1e-8  # of Krylov's method with multigrid, of a coupling [s]
ITERATIONS = 120  # of one contact problem, quasi-static
NEWTON = 5  # its Newton steps
RANK_BYTES = 5.0e3  # matrix, multigrid and vectors of a node, on its rank [bytes]
FIRST_BYTES = 2.0e3  # mesh, states and whole vectors of a node, on rank 0 [bytes]
FIRST_SECONDS = 1.0e-6  # work of rank 0 alone, of a node and a Newton step [s]
# Assumed of a cluster's network.
LATENCY = 2e-6  # of a message [s]
BANDWIDTH = 10e9  # of a rank 0's node [bytes/s]
SHARED = 1e9  # of each rank where all ranks of a node talk at once [bytes/s]
# Of multigrid.
COARSENING = 12.0  # nodes of a level over those of the next
EXCHANGES = 8  # with neighbours, of a level in one iteration: relaxation, residual, transfer


def model(unknowns, contacts, ranks):
    nodes = unknowns / 3
    own = nodes / ranks
    levels = max(1, math.ceil(math.log(nodes / 50, COARSENING)))
    work = ITERATION * COUPLINGS * own
    halo = 24 * 6 * own ** (2 / 3)
    messages = levels * EXCHANGES * 6 * LATENCY + 1.3 * EXCHANGES * halo / SHARED
    sums = 3 * 2 * math.log2(ranks) * LATENCY
    solves = NEWTON + 3  # and the certificate's
    vectors = solves * 2 * 8 * unknowns / BANDWIDTH
    blocks = NEWTON * 80 * contacts * (1 + math.log2(ranks)) / BANDWIDTH
    return {
        "ranks": ranks,
        "memory of a rank [GB]": RANK_BYTES * own / 1e9,
        "memory of rank 0 [GB]": (FIRST_BYTES * nodes + RANK_BYTES * own) / 1e9,
        "work [s]": ITERATIONS * work,
        "neighbours [s]": ITERATIONS * messages,
        "sums [s]": ITERATIONS * sums,
        "vectors through rank 0 [s]": vectors,
        "contacts to all [s]": blocks,
        "rank 0 alone [s]": NEWTON * FIRST_SECONDS * nodes,
    }


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--unknowns", type=float, default=1e9)
    parser.add_argument("--contacts", type=float, default=1e6)
    parser.add_argument("--ranks", default="256,1024,4096")
    a = parser.parse_args()
    rows = [model(a.unknowns, a.contacts, int(r)) for r in a.ranks.split(",")]
    for name in rows[0]:
        print(f"| {name} | " + " | ".join(f"{row[name]:.3g}" for row in rows) + " |")


if __name__ == "__main__":
    main()
