# formation_gnc on Ubuntu 24.04, ROS 2 from the wheels on PyPI. What it takes of the system is the first RUN alone.
#   docker build -t formation_gnc . && docker run --rm -it formation_gnc
#   docker run --rm -it --network host --ipc host formation_gnc     # to be heard by nodes outside: shared memory, multicast
FROM ubuntu:24.04

RUN apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends \
        python3.12 python3.12-dev python3.12-venv g++ make git ca-certificates procps && \
    rm -rf /var/lib/apt/lists/*

COPY . /formation_gnc
WORKDIR /formation_gnc
RUN make setup

# Bags of a container go to a volume: -v "$PWD/bags:/formation_gnc/bags"
CMD ["bash", "-c", "source env.sh && exec bash -i"]
