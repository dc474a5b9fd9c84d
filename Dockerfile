# docker build -t internav-data .
# docker run --rm -v "$PWD/demo:/work/demo" internav-data demo
# docker run --rm -v "$PWD/data:/work/data" --entrypoint internav-gen internav-data generate --out data/mine --scenes 120
FROM python:3.11-slim AS build
WORKDIR /src
COPY . .
RUN pip install --no-cache-dir build && python -m build --wheel --outdir /dist

FROM python:3.11-slim
COPY constraints.txt /tmp/
COPY --from=build /dist /tmp/dist
RUN pip install --no-cache-dir --constraint /tmp/constraints.txt \
      "$(ls /tmp/dist/*.whl)[generate]" gymnasium \
 && rm -r /tmp/dist \
 && NUMBA_CACHE_DIR=/var/cache/numba internav-gen warmup
ENV NUMBA_CACHE_DIR=/var/cache/numba
WORKDIR /work
ENTRYPOINT ["internav-data"]
CMD ["doctor"]
