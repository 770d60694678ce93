/* Change from one picture to another, as the mean over the height of each row of blocks. Arguments: two pictures of one
   size; result, means of whole levels, which a float represents exactly. */
LOOP(block_damage_mean_change, "pps", "") {
    const Arg *now = &in[0], *then = &in[1];
    int64_t columns = in[2].shape[1];
    float *mean = (float *)in[2].data;
    int is_plain = now->bytes == 1 && then->bytes == 1 && now->stride[1] == 1 && then->stride[1] == 1;
    int32_t *sum = room(columns, sizeof(int32_t));
    for (int64_t block = 0; block < in[2].shape[0]; block++) {
        memset(sum, 0, (size_t)columns * sizeof(int32_t));
        for (int64_t row = SQUARE_PX * block; row < SQUARE_PX * (block + 1); row++) {
            const uint8_t *a = (const uint8_t *)now->data + row * now->stride[0];
            const uint8_t *b = (const uint8_t *)then->data + row * then->stride[0];
            if (is_plain)
                for (int64_t j = 0; j < columns; j++) sum[j] += a[j] - b[j];
            else
                for (int64_t j = 0; j < columns; j++) sum[j] += (int32_t)(pixel(now, row, j) - pixel(then, row, j));
        }
        for (int64_t j = 0; j < columns; j++) mean[block * columns + j] = (float)sum[j] / SQUARE_PX;
    }
    free(sum);
}
